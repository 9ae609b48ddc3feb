#include "server/builder/all_cores.h"

#include <oneapi/tbb/parallel_for.h>

namespace intervale {

void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece) { tbb::parallel_for(std::size_t(0), count, piece); }

}  // namespace intervale
