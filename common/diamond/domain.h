// The sampled box inside the virtual grid of (2^N + 1)^3 vertices (FORMAT.md, "The box").
//
// A vertex stands for the sample that its coordinates clamp to, in value and in position. Clamping is monotone on each
// axis, so no tetrahedron is turned inside out; those outside the box become flat and do not exist.
#pragma once

#include <algorithm>
#include <array>
#include <bit>

#include "common/diamond/diamond.h"
#include "common/diamond/grid.h"
#include "common/util/bits.h"

namespace intervale {

class Domain {
 public:
  // Sides in [kMinSide, kMaxSide].
  explicit Domain(const std::array<std::int32_t, 3>& dims)
      : last_{dims[0] - 1, dims[1] - 1, dims[2] - 1},
        levels_(std::max(1, int(std::bit_width(std::uint32_t(std::max({last_.x, last_.y, last_.z}) - 1))))) {}

  // N: the smallest, at least 1, for which the virtual grid contains the box
  [[nodiscard]] int levels() const { return levels_; }
  [[nodiscard]] Vertex last() const { return last_; }  // the sample furthest from (0, 0, 0)
  // Centre of the root
  [[nodiscard]] Vertex root() const { return {1 << (levels_ - 1), 1 << (levels_ - 1), 1 << (levels_ - 1)}; }
  [[nodiscard]] bool is_whole() const {  // whether the box is the whole virtual grid, so that nothing ever clamps
    return last_.x == 1 << levels_ && last_.y == 1 << levels_ && last_.z == 1 << levels_;
  }

  [[nodiscard]] Vertex clamp(Vertex v) const { return {std::clamp(v.x, 0, last_.x), std::clamp(v.y, 0, last_.y), std::clamp(v.z, 0, last_.z)}; }
  [[nodiscard]] bool contains(Vertex v) const { return v == clamp(v); }

  // The root's local number of a corner of the virtual grid; -1 for any other vertex of a diamond.
  [[nodiscard]] int corner_number(Vertex v) const {
    const std::int32_t n = std::int32_t(1) << levels_;
    if (((v.x | v.y | v.z) & (n - 1)) != 0) return -1;
    const Diamond root(this->root());
    for (int i = 0; i < root.row->vertices; ++i) {
      if (root.vertex(i) == v) return i;
    }
    return -1;
  }

  // Whether all vertices of the diamond lie in the box: its tetrahedra then all exist, and none is moved by clamping.
  [[nodiscard]] bool is_interior(const Diamond& d) const {
    return contains({d.centre.x - d.h, d.centre.y - d.h, d.centre.z - d.h}) && contains({d.centre.x + d.h, d.centre.y + d.h, d.centre.z + d.h});
  }

  // Whether clamping moves only vertices of tetrahedra that lie outside the virtual grid. The other tetrahedra have the
  // shapes that they have in the interior.
  [[nodiscard]] bool is_unmoved(const Diamond& d) const {
    const auto unmoved = [&d, n = std::int32_t(1) << levels_](std::int32_t c, std::int32_t last) { return c + d.h <= last || (last == n && c == n); };
    return unmoved(d.centre.x, last_.x) && unmoved(d.centre.y, last_.y) && unmoved(d.centre.z, last_.z);
  }

  // What clamping does to a centre's coordinate c on an axis, and to those h below and above: bit 0 if it makes the
  // lower two equal, bit 1 if the upper two.
  [[nodiscard]] unsigned squeezed(int axis, std::int32_t c, std::int32_t h) const {
    const std::int32_t last = axis == 0 ? last_.x : axis == 1 ? last_.y : last_.z;
    const std::int32_t below = std::clamp(c - h, 0, last), middle = std::clamp(c, 0, last), above = std::clamp(c + h, 0, last);
    return unsigned(below == middle) | unsigned(middle == above) << 1;
  }

  // One bit for each tetrahedron of the diamond that exists, because it is not flat after clamping. 0: nothing of the
  // diamond exists.
  [[nodiscard]] unsigned tets(const Diamond& d) const {
    return tets(*d.row, {squeezed(0, d.centre.x, d.h), squeezed(1, d.centre.y, d.h), squeezed(2, d.centre.z, d.h)});
  }
  // The same, from squeezed() on each axis. The volume of a tetrahedron is a product of differences of coordinates, one
  // an axis: it is 0 only if, on an axis, all vertices come to lie at one coordinate.
  [[nodiscard]] static unsigned tets(const DiamondType& row, const std::array<unsigned, 3>& squeezed) {
    unsigned flat = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (squeezed[axis] == 3) return 0;
      const auto [below, above] = row.beyond[axis];
      flat |= (squeezed[axis] & 1) != 0 ? below & ~above : 0;
      flat |= (squeezed[axis] & 2) != 0 ? above & ~below : 0;
    }
    return ((1u << row.tets) - 1) & ~flat;
  }

  // One bit for each local vertex (kCentre not among them) of a tetrahedron in the mask.
  [[nodiscard]] static unsigned vertices(const DiamondType& row, unsigned tets) {
    unsigned mask = 0;
    for (const int tet : set_bits(tets)) mask |= row.tet_vertices[tet];
    return mask;
  }

  // One bit for each edge of a tetrahedron in the mask, in local numbers.
  [[nodiscard]] static unsigned edges(const DiamondType& row, unsigned tets) {
    unsigned mask = 0;
    for (const int tet : set_bits(tets)) mask |= row.tet_edges[tet];
    return mask;
  }

  // Whether splitting the diamond would change nothing: class 2 with h = 1 whose clamped centre is an end of its spine.
  // It needs no update, and is never split.
  [[nodiscard]] bool is_noop(const Diamond& d) const {
    if (d.row->cls != 2 || d.h != 1) return false;
    const Vertex c = clamp(d.centre);
    return c == clamp(d.vertex(0)) || c == clamp(d.vertex(1));
  }

  // Clamped positions of four local vertices (kCentre may be among them).
  [[nodiscard]] std::array<Vertex, 4> positions(const Diamond& d, const std::array<std::uint8_t, 4>& local) const {
    return {clamp(d.vertex(local[0])), clamp(d.vertex(local[1])), clamp(d.vertex(local[2])), clamp(d.vertex(local[3]))};
  }

  // Whether a tetrahedron is not flat.
  [[nodiscard]] static bool exists(const std::array<Vertex, 4>& p) {
    const auto d = [&p](int i) { return std::array<std::int64_t, 3>{p[i].x - p[0].x, p[i].y - p[0].y, p[i].z - p[0].z}; };
    const auto a = d(1), b = d(2), c = d(3);
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]) != 0;
  }

 private:
  Vertex last_;
  int levels_;
};

}  // namespace intervale
