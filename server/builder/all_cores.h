// Runs independent pieces of work on all cores that oneTBB may use.
#pragma once

#include <cstddef>
#include <functional>

namespace intervale {

// A ParallelFor (common/util/parallel.h).
void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece);

// Runs `work`; what it runs on all cores gets those that others do not want.
void on_spare_cores(const std::function<void()>& work);

}  // namespace intervale
