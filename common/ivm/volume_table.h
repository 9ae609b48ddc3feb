// The volume that a range of values encloses, for any range, from a table over the values.
//
// F is the field interpolated linearly in each tetrahedron of the mesh that is refined everywhere. In a tetrahedron with
// the values a <= b <= c <= d, the volume of {F < v} is a piecewise cubic function of v, a B-spline's integral; where all
// four are equal it jumps. The table holds the sums over all tetrahedra at chosen positions.
#pragma once

#include <vector>

#include "common/patch/description.h"

namespace intervale {

// Shares of the box, 0 to 1.
struct VolumeTable {
  std::vector<double> position;   // values of the field, ascending; the first is its least one, the last its greatest
  std::vector<double> below;      // the share of {F < position}: 0 at first
  std::vector<double> not_above;  // the share of {F <= position}: 1 at last; differs from `below` where F is constant

  // The share of {F < v}, and of {F <= v}. At a position as in the table; in between linear. Infinite v: 0 or 1.
  [[nodiscard]] double share_below(double v) const;
  [[nodiscard]] double share_not_above(double v) const;
  // The share of the interval volume {alpha <= F <= beta}.
  [[nodiscard]] double share_of(const Range& range) const;
  friend bool operator==(const VolumeTable&, const VolumeTable&) = default;
};

// What a share between two positions may be off by; at positions shares are off by less than 1e-6.
inline constexpr double kVolumeTolerance = 0.001;

}  // namespace intervale
