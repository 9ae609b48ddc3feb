// The interval volume inside one tetrahedron, as tetrahedra: 15 cases by how many of its vertices lie below, inside and
// above the range.
//
// Gregory M. Nielson and Junwon Sung, "Interval Volume Tetrahedrization", 1997 (the cases); Weiss and De Floriani 2008,
// section 7 (their use). The table is generated: the part of the tetrahedron inside the range is a convex polyhedron
// whose corners are inside vertices and cuts; every face is split from its lowest corner, and the polyhedron is coned
// from its lowest corner. One order holds for all tetrahedra (by the midpoint of the edge that a corner lies on, a
// vertex being its own midpoint; then alpha before beta), so that two tetrahedra split the face that they share in the
// same way.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/patch/range.h"

namespace intervale {

// A corner of a patch within its tetrahedron, whose vertices 0..3 ascend by coordinates: 0..3 a vertex, 4 + 2 * edge
// the alpha cut of an edge and 5 + 2 * edge its beta cut, edges being 01 02 03 12 13 23.
using PatchCorner = std::uint8_t;
inline constexpr int kPatchCorners = 16;

// The ascending order of the vertices leaves five comparisons of midpoints open; an order (0 to 31) holds a bit for
// each:
//   bit 0: (v0 + v2) / 2 < v1
//   bit 1: (v0 + v3) / 2 < v1
//   bit 2: v0 + v3 < v1 + v2
//   bit 3: (v0 + v3) / 2 < v2
//   bit 4: (v1 + v3) / 2 < v2
inline constexpr int kTetOrders = 32;

// The sides of a tetrahedron's vertices 0..3 in one number below 256: two bits each, vertex 0 lowest.
[[nodiscard]] constexpr unsigned tet_sides(Side a, Side b, Side c, Side d) {
  return unsigned(a) | unsigned(b) << 2 | unsigned(c) << 4 | unsigned(d) << 6;
}

// The sides of four local vertices in the order of a shape, as of tet_sides; sides: two bits each, by local vertex.
[[nodiscard]] inline unsigned shape_sides(const TetShape& s, std::uint32_t sides) {
  return (sides >> (2 * s.vertex[0]) & 3) | (sides >> (2 * s.vertex[1]) & 3) << 2 | (sides >> (2 * s.vertex[2]) & 3) << 4 |
         (sides >> (2 * s.vertex[3]) & 3) << 6;
}

// Sides of the tetrahedra around a diamond and of their halves, encoded as by tet_sides: both ends of the spine (of a
// half: the end that stays, then the centre), belt i and belt i + 1. sides: two bits each, by local vertex.
class Ring {
 public:
  Ring(std::uint32_t sides, int belt) : ends_{sides & 3, sides >> 2 & 3}, centre_(sides >> (2 * kCentre) & 3) {
    belt_ = sides >> 4 & ((1u << (2 * belt)) - 1);
    belt_ |= (belt_ & 3) << (2 * belt);  // the ring closes
  }
  [[nodiscard]] unsigned tet(int i) const { return ends_[0] | ends_[1] << 2 | (belt_ >> (2 * i) & 15) << 4; }
  [[nodiscard]] unsigned belt_pair(int i) const { return belt_ >> (2 * i) & 15; }
  [[nodiscard]] unsigned half(int i, int end) const { return ends_[end] | centre_ << 2 | (belt_ >> (2 * i) & 15) << 4; }

 private:
  std::array<std::uint32_t, 2> ends_;
  std::uint32_t belt_, centre_;
};

class TetCases {
 public:
  TetCases();

  // The patch's tetrahedra as corners, positively oriented when vertices 0..3 are (else exchange two corners of each).
  // sides: as encoded by tet_sides.
  [[nodiscard]] std::span<const std::array<PatchCorner, 4>> tets(int order, unsigned sides) const {
    const Entry e = entries_[order * 256 + sides];
    return {tets_.data() + e.first, e.count};
  }
  [[nodiscard]] unsigned count(int order, unsigned sides) const { return entries_[order * 256 + sides].count; }
  // Their faces that lie on a surface, counterclockwise from outside if the tetrahedra are positive: three alpha cuts or
  // three beta cuts each.
  [[nodiscard]] std::span<const std::array<PatchCorner, 3>> faces(int order, unsigned sides) const {
    const Entry e = entries_[order * 256 + sides];
    return {faces_.data() + e.first_face, e.faces};
  }
  // The most tetrahedra that a patch has.
  [[nodiscard]] unsigned most() const { return most_; }

  // The number of tetrahedra if it is the same for every order, with the vertices in any sequence; otherwise kDepends,
  // which is so for some tetrahedra with vertices below, inside and above.
  static constexpr unsigned kDepends = 255;
  [[nodiscard]] unsigned count(unsigned sides) const { return counts_[sides]; }

 private:
  struct Entry {
    std::uint16_t first = 0, first_face = 0;
    std::uint8_t count = 0, faces = 0;
  };
  std::vector<Entry> entries_;
  std::vector<std::array<PatchCorner, 4>> tets_;
  std::vector<std::array<PatchCorner, 3>> faces_;
  std::array<std::uint8_t, 256> counts_{};
  unsigned most_ = 0;
};

// The table, computed at first use.
[[nodiscard]] const TetCases& tet_cases();

}  // namespace intervale
