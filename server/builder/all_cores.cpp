#include "server/builder/all_cores.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace intervale {

void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece) { tbb::parallel_for(std::size_t(0), count, piece); }

void on_spare_cores(const std::function<void()>& work) {
  tbb::task_arena arena(tbb::task_arena::automatic, 1, tbb::task_arena::priority::low);
  arena.execute(work);
}

}  // namespace intervale
