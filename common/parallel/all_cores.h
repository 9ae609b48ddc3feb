// Runs independent pieces of work on all cores that oneTBB may use.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <stop_token>

#include "common/util/parallel.h"

namespace intervale {

// A ParallelFor (common/util/parallel.h).
void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece);

// The same in runs: calls run(begin, end) for parts of [0, count) that cover it, some for each core.
void on_all_cores_in_runs(std::size_t count, const std::function<void(std::size_t begin, std::size_t end)>& run);

// Thrown by what was stopped.
struct Stopped : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "stopped"; }
};
// on_all_cores() that throws Stopped, instead of beginning a piece, once `stop` is requested.
ParallelFor on_all_cores_until(std::stop_token stop);

// Runs `work`; what it runs on all cores gets those that others do not want.
void on_spare_cores(const std::function<void()>& work);

// While it exists, oneTBB keeps its threads; then they end, and are waited for: none runs any more when main() returns.
// Make one in main().
class AllCores {
 public:
  AllCores();
  AllCores(const AllCores&) = delete;
  AllCores& operator=(const AllCores&) = delete;
  ~AllCores();

 private:
  struct Scheduler;
  std::unique_ptr<Scheduler> scheduler_;
};

// Lowers the priority of the calling thread: the system runs the threads of other work first.
void yield_to_other_threads();

}  // namespace intervale
