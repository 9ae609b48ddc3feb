#include "common/parallel/all_cores.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/resource.h>
#include <unistd.h>

#include <new>
#include <utility>

namespace intervale {

void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece) { tbb::parallel_for(std::size_t(0), count, piece); }

void on_all_cores_in_runs(std::size_t count, const std::function<void(std::size_t begin, std::size_t end)>& run) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&run](const auto& part) { run(part.begin(), part.end()); });
}

ParallelFor on_all_cores_until(std::stop_token stop) {
  return [stop = std::move(stop)](std::size_t count, const std::function<void(std::size_t)>& piece) {
    on_all_cores(count, [&](std::size_t i) {
      if (stop.stop_requested()) throw Stopped();
      piece(i);
    });
  };
}

struct AllCores::Scheduler {
  tbb::task_scheduler_handle handle{tbb::attach{}};
};
AllCores::AllCores() : scheduler_(std::make_unique<Scheduler>()) {}
AllCores::~AllCores() { (void)tbb::finalize(scheduler_->handle, std::nothrow); }  // false: other threads still use oneTBB

void on_spare_cores(const std::function<void()>& work) {
  tbb::task_arena arena(tbb::task_arena::automatic, 1, tbb::task_arena::priority::low);
  arena.execute(work);
}

void yield_to_other_threads() {
  constexpr int kNice = 10;
  (void)::setpriority(PRIO_PROCESS, id_t(::gettid()), kNice);  // on Linux of one thread; it only fails if it is lower already
}

}  // namespace intervale
