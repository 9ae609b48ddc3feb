// What a client asks for: how fine, where, and how much of it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace intervale {

// An axis-aligned box in world coordinates, closed: min[i] <= max[i].
struct Box {
  std::array<double, 3> min{};
  std::array<double, 3> max{};
  friend bool operator==(const Box&, const Box&) = default;
};

// A level of detail. Updates are wanted where their saturated error is greater than `error` (every relevant update for error 0), inside
// `roi` if there is one; everything else is only as fine as conformity needs. Budgets cut that short, greatest error first.
struct Lod {
  double error = 0;                     // in the field's units, at least 0
  std::optional<double> error_percent;  // instead of `error`: 0 to 100 percent of the data set's max_error
  std::optional<Box> roi;
  std::optional<std::uint64_t> max_tets;     // the mesh never has more tetrahedra than this
  std::optional<std::uint64_t> max_updates;  // nor more updates than this
  friend bool operator==(const Lod&, const Lod&) = default;
};

}  // namespace intervale
