#include "server/builder/all_cores.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <utility>

namespace intervale {

void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece) { tbb::parallel_for(std::size_t(0), count, piece); }

ParallelFor on_all_cores_until(std::stop_token stop) {
  return [stop = std::move(stop)](std::size_t count, const std::function<void(std::size_t)>& piece) {
    on_all_cores(count, [&](std::size_t i) {
      if (stop.stop_requested()) throw Stopped();
      piece(i);
    });
  };
}

void on_spare_cores(const std::function<void()>& work) {
  tbb::task_arena arena(tbb::task_arena::automatic, 1, tbb::task_arena::priority::low);
  arena.execute(work);
}

}  // namespace intervale
