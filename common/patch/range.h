// The side of a value with respect to a range, and the cuts of the range's two surfaces on an edge.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/patch/description.h"

namespace intervale {

// R(v) of the paper, section 2, there -1, 0 and 1: below alpha, in [alpha, beta], above beta.
enum class Side : std::uint8_t { below = 0, inside = 1, above = 2 };

[[nodiscard]] constexpr Side side_of(double value, const Range& range) {
  return value < range.alpha ? Side::below : value > range.beta ? Side::above : Side::inside;
}

// Whether an edge between these sides is cut by the alpha surface, by the beta surface, and by how many of the two.
[[nodiscard]] constexpr bool alpha_cuts(Side a, Side b) { return (a == Side::below) != (b == Side::below); }
[[nodiscard]] constexpr bool beta_cuts(Side a, Side b) { return (a == Side::above) != (b == Side::above); }
[[nodiscard]] constexpr int cut_count(Side a, Side b) { return a > b ? int(a) - int(b) : int(b) - int(a); }

// The cuts on one edge, alpha before beta. A cut q lies at (q + 0.5) / 256 of the edge from its first end. On a
// subdivision edge, whose first end is the centre, this fraction is the paper's coefficient gamma (section 7).
struct Cuts {
  std::uint8_t count = 0;
  std::uint8_t q[2] = {0, 0};
};

// The same cuts seen from the edge's other end.
[[nodiscard]] constexpr Cuts reversed(Cuts c) {
  c.q[0] = std::uint8_t(255 - c.q[0]);
  c.q[1] = std::uint8_t(255 - c.q[1]);
  return c;
}

// How far kappa lies from `low` to `high`, in 512ths rounded down, at most 511. low < high, kappa between them.
[[nodiscard]] inline unsigned half_steps_to(double kappa, double low, double high) {
  const double whole = high / 2 - low / 2;  // halved: the difference of two doubles can overflow
  return unsigned(std::clamp((kappa / 2 - low / 2) / whole * 512, 0.0, 511.0));
}

// The cut of an edge by the surface of kappa alone. The ends' values are on different sides of it. Without branches, for
// either end is as likely to be the greater one.
[[nodiscard]] inline std::uint8_t cut_between(double from, double to, double kappa) {
  const unsigned q = half_steps_to(kappa, std::min(from, to), std::max(from, to)) / 2;
  return std::uint8_t(q ^ (0u - unsigned(from > to)));  // 255 - q seen from the other end
}

// The cuts of an edge whose ends have the finite values `from` and `to`; exchanging the ends gives the reversed cuts.
// Where alpha < beta and both surfaces cut, the cut nearer to `from` stays strictly nearer: if quantisation makes them
// equal, one moves by a step, so that neither is off by more than a step; nor by more than one and a half at the ends
// of the edge.
[[nodiscard]] inline Cuts cuts_between(double from, double to, const Range& range) {
  const double low = std::min(from, to), high = std::max(from, to);
  const Side a = side_of(low, range), b = side_of(high, range);
  Cuts cuts;
  if (alpha_cuts(a, b)) cuts.q[cuts.count++] = std::uint8_t(half_steps_to(range.alpha, low, high) / 2);
  if (beta_cuts(a, b)) cuts.q[cuts.count++] = std::uint8_t(half_steps_to(range.beta, low, high) / 2);
  if (cuts.count == 2 && range.alpha < range.beta && cuts.q[0] == cuts.q[1]) {
    // If beta lies in the lower half of the step, so does alpha.
    const bool is_lower = half_steps_to(range.beta, low, high) % 2 == 0;
    if (cuts.q[0] == 255 || (is_lower && cuts.q[0] > 0)) {
      --cuts.q[0];
    } else {
      ++cuts.q[1];
    }
  }
  return from > to ? reversed(cuts) : cuts;
}

}  // namespace intervale
