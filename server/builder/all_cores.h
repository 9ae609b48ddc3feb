// Runs independent pieces of work on all cores that oneTBB may use.
#pragma once

#include <cstddef>
#include <functional>

namespace intervale {

// A ParallelFor (common/util/parallel.h).
void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece);

}  // namespace intervale
