// Processor time of the calling thread: what others take of a busy machine meanwhile does not count.
#pragma once

#include <chrono>
#include <ctime>

namespace intervale {

[[nodiscard]] inline std::chrono::steady_clock::duration thread_time() {
  timespec time{};
  (void)::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);  // does not fail on Linux
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace intervale
