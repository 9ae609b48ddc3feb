// What exists of the diamonds at the border of the box.
//
// Along one axis, the position of a centre of one scale is of one of seven kinds (BorderShapes::Position). Three kinds,
// one an axis, determine which of a diamond's tetrahedra exist: one small table a scale.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/diamond/domain.h"

namespace intervale {

struct BorderShape {
  const DiamondType* row = nullptr;
  std::uint32_t tets = 0, vertices = 0, edges = 0;  // a bit for each that exists, as of Domain
  std::uint32_t unmoved = 0;                        // tetrahedra all of whose vertices lie in the box
  bool interior = false;                            // all vertices do
  bool splits = false;                              // some of it exists, and splitting it would change that
};

class BorderShapes {
 public:
  // The kind of a coordinate: the first one; those whose neighbours on both sides lie in the box, by their two lowest
  // bits; the one whose next neighbour lies past the last sample; and the one past the last sample.
  enum Position : std::uint8_t { kFirst = 0, kBetween = 1, kStraddling = 5, kPast = 6 };
  static constexpr int kPositions = 7;

  BorderShapes(const Domain& domain, int scale) : scale_(scale), last_(domain.last()), table_(std::size_t(kPositions * kPositions * kPositions)) {
    std::array<std::array<std::int32_t, kPositions>, 3> at{};  // a coordinate, in units of h, for each kind; -1 where the axis has none
    for (auto& axis : at) axis.fill(-1);
    for (int k = 0; k < 3; ++k) {
      for (std::int32_t i = std::min<std::int32_t>(count(k), kStraddling); --i >= 0;) at[k][position(k, i)] = i;
      for (std::int32_t i = std::max(0, count(k) - 2); i < count(k); ++i) at[k][position(k, i)] = i;
    }
    for (int z = 0; z < kPositions; ++z) {
      for (int y = 0; y < kPositions; ++y) {
        for (int x = 0; x < kPositions; ++x) {
          const std::array<std::int32_t, 3> i{at[0][x], at[1][y], at[2][z]};
          if (i[0] < 0 || i[1] < 0 || i[2] < 0 || ((i[0] | i[1] | i[2]) & 1) == 0) continue;
          table_[index(x, y, z)] = shape_of(domain, Diamond({i[0] << scale, i[1] << scale, i[2] << scale}));
        }
      }
    }
  }

  [[nodiscard]] static BorderShape shape_of(const Domain& domain, const Diamond& d) {
    BorderShape s;
    s.row = d.row;
    s.interior = domain.is_interior(d);
    s.tets = domain.tets(d);
    for (int i = 0; i < d.row->tets; ++i) {
      const auto local = d.row->tet(i);
      s.unmoved |= unsigned(std::all_of(local.begin(), local.end(), [&](int v) { return domain.contains(d.vertex(v)); })) << i;
    }
    s.vertices = Domain::vertices(*d.row, s.tets);
    s.edges = Domain::edges(*d.row, s.tets);
    s.splits = s.tets != 0 && !domain.is_noop(d);
    return s;
  }

  // How many coordinates centres of this scale have along an axis, in units of h: [0, count).
  [[nodiscard]] std::int32_t count(int axis) const { return ((last(axis) - 1) >> scale_) + 2; }

  // The coordinates of kind kBetween and up to kStraddling are [1, between_end), in units of h.
  [[nodiscard]] std::int32_t between_end(int axis) const { return std::max(1, last(axis) >> scale_); }

  // The kind of coordinate i, in units of h, i in [0, count(axis)).
  [[nodiscard]] int position(int axis, std::int32_t i) const {
    const std::int32_t straddling = last(axis) >> scale_;
    if (i == 0) return kFirst;
    if (i < straddling) return between(i);
    return i == straddling ? kStraddling : kPast;
  }
  [[nodiscard]] static int between(std::int32_t i) { return kBetween + (i & 3); }
  [[nodiscard]] const BorderShape& of(int position_x, int position_y, int position_z) const {
    return table_[index(position_x, position_y, position_z)];
  }

 private:
  [[nodiscard]] std::int32_t last(int axis) const { return axis == 0 ? last_.x : axis == 1 ? last_.y : last_.z; }
  [[nodiscard]] static std::size_t index(int x, int y, int z) { return std::size_t((z * kPositions + y) * kPositions + x); }
  int scale_;
  Vertex last_;
  std::vector<BorderShape> table_;
};

}  // namespace intervale
