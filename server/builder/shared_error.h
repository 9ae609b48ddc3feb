// The error of one diamond (interpolation_error.h), its tetrahedra shared out among threads if they are large.
#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>

#include "common/diamond/diamond.h"
#include "common/ranges/border_shape.h"
#include "common/ranges/interpolation_error.h"

namespace intervale {

inline constexpr int kSharedScale = 5;  // diamonds of this scale and coarser are few and large

// Uses all cores that oneTBB may.
template <class T>
[[nodiscard]] double shared_error(const DiamondErrors<T>& error_of, const Diamond& d, const BorderShape& shape) {
  if (d.scale < kSharedScale) return error_of(d, shape);
  return tbb::parallel_reduce(
      tbb::blocked_range<int>(0, d.row->tets, 1), 0.0,
      [&](const auto& tets, double worst) {
        for (int i = tets.begin(); i != tets.end(); ++i) worst = std::max(worst, error_of(d, shape, 1u << i));
        return worst;
      },
      [](double a, double b) { return std::max(a, b); });
}

}  // namespace intervale
