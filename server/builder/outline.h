// What there is of a diamond at the border of the box.
//
// Along one axis a centre's place at one scale is one of seven: the first, the last or the one past the last, whose vertices may be moved or outside;
// or between them, by its two lowest bits. Three such places tell which of a diamond's tetrahedra exist, so that is one small table a scale.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/diamond/domain.h"

namespace intervale {

struct Outline {
  const DiamondType* row = nullptr;
  std::uint32_t tets = 0, vertices = 0, edges = 0;  // a bit for each that exists, as of Domain
  std::uint32_t unmoved = 0;                        // tetrahedra all of whose vertices lie in the box
  bool interior = false;                            // all vertices do
  bool splits = false;                              // there is something of it, and splitting it would change that
};

class Outlines {
 public:
  static constexpr int kPlaces = 7;

  Outlines(const Domain& domain, int scale) : scale_(scale), last_(domain.last()), table_(std::size_t(kPlaces * kPlaces * kPlaces)) {
    std::array<std::array<std::int32_t, kPlaces>, 3> at{};  // a coordinate, in units of h, for each place; -1 where the axis has none
    for (auto& axis : at) axis.fill(-1);
    for (int k = 0; k < 3; ++k) {
      for (std::int32_t i = std::min(count(k), 4 + 1); --i >= 0;) at[k][place(k, i)] = i;
      for (std::int32_t i = std::max(0, count(k) - 2); i < count(k); ++i) at[k][place(k, i)] = i;
    }
    for (int z = 0; z < kPlaces; ++z) {
      for (int y = 0; y < kPlaces; ++y) {
        for (int x = 0; x < kPlaces; ++x) {
          const std::array<std::int32_t, 3> i{at[0][x], at[1][y], at[2][z]};
          if (i[0] < 0 || i[1] < 0 || i[2] < 0 || ((i[0] | i[1] | i[2]) & 1) == 0) continue;
          table_[index(x, y, z)] = outline_of(domain, Diamond({i[0] << scale, i[1] << scale, i[2] << scale}));
        }
      }
    }
  }

  [[nodiscard]] static Outline outline_of(const Domain& domain, const Diamond& d) {
    Outline o;
    o.row = d.row;
    o.interior = domain.is_interior(d);
    o.tets = domain.tets(d);
    for (int i = 0; i < d.row->tets; ++i) {
      const auto local = d.row->tet(i);
      o.unmoved |= unsigned(std::all_of(local.begin(), local.end(), [&](int v) { return domain.contains(d.vertex(v)); })) << i;
    }
    o.vertices = Domain::vertices(*d.row, o.tets);
    o.edges = Domain::edges(*d.row, o.tets);
    o.splits = o.tets != 0 && !domain.is_noop(d);
    return o;
  }

  // How many places centres of this scale have along an axis, in units of h: [0, count).
  [[nodiscard]] std::int32_t count(int axis) const { return ((last(axis) - 1) >> scale_) + 2; }

  // The kind of place of coordinate i, in units of h, i in [0, count(axis)).
  [[nodiscard]] int place(int axis, std::int32_t i) const {
    const std::int32_t straddles = last(axis) >> scale_;  // the first whose next neighbour lies past the last sample
    if (i == 0) return 0;
    if (i < straddles) return 1 + (i & 3);
    return i == straddles ? 5 : 6;
  }
  [[nodiscard]] const Outline& of(int place_x, int place_y, int place_z) const { return table_[index(place_x, place_y, place_z)]; }

 private:
  [[nodiscard]] std::int32_t last(int axis) const { return axis == 0 ? last_.x : axis == 1 ? last_.y : last_.z; }
  [[nodiscard]] static std::size_t index(int x, int y, int z) { return std::size_t((z * kPlaces + y) * kPlaces + x); }
  int scale_;
  Vertex last_;
  std::vector<Outline> table_;
};

}  // namespace intervale
