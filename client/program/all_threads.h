// Runs independent pieces of work on all cores of the machine.
#pragma once

#include <cstddef>
#include <functional>

namespace intervale {

// A ParallelFor (common/util/parallel.h). Clients do without oneTBB, which on_all_cores() of the server needs. Starts
// its threads anew. Throws what a piece throws.
void on_all_threads(std::size_t count, const std::function<void(std::size_t)>& piece);

}  // namespace intervale
