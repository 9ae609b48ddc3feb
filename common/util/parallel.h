// How independent pieces of work are run. This layer knows no threads: whoever has some passes a way to use them.
#pragma once

#include <cstddef>
#include <functional>

namespace intervale {

// Calls piece(i) for every i in [0, count), in any order, perhaps on many threads, and returns when all are done.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& piece)>;

// Called with the share done, 0 to 1, now and then, by the thread that waits for the work.
using OnProgress = std::function<void(double)>;

// One after the other.
inline void in_turn(std::size_t count, const std::function<void(std::size_t)>& piece) {
  for (std::size_t i = 0; i < count; ++i) piece(i);
}

}  // namespace intervale
