// An interface for parallel loops. The common layer creates no threads: the caller passes a ParallelFor.
#pragma once

#include <cstddef>
#include <functional>

namespace intervale {

// Calls piece(i) for every i in [0, count), in any order, possibly on several threads. Returns when all calls are done. To
// stop long work, one may throw instead of beginning a piece: whoever calls it passes that on, and leaves nothing behind.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& piece)>;

// A ParallelFor that runs on the calling thread.
inline void serial(std::size_t count, const std::function<void(std::size_t)>& piece) {
  for (std::size_t i = 0; i < count; ++i) piece(i);
}

// Where a long loop without pieces may be stopped: throws if `parallel` does.
inline void may_stop(const ParallelFor& parallel) {
  parallel(1, [](std::size_t) {});
}

}  // namespace intervale
