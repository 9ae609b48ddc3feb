// Which few errors stand for all of them.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace intervale {

// At most `most` values (2 or more), ascending, the last one the largest error: each error rounds up to the first that is not smaller. All distinct
// errors if there are no more; else chosen so that rounding adds as small a share as can be to the number of errors above any threshold. O(n log n).
[[nodiscard]] std::vector<float> choose_error_levels(std::span<const float> errors, std::size_t most);

}  // namespace intervale
