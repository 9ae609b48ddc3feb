// Runs independent pieces of work on all cores that oneTBB may use.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <stop_token>

#include "common/util/parallel.h"

namespace intervale {

// A ParallelFor (common/util/parallel.h).
void on_all_cores(std::size_t count, const std::function<void(std::size_t)>& piece);

// Thrown by what was stopped.
struct Stopped : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "stopped"; }
};
// on_all_cores() that throws Stopped, instead of beginning a piece, once `stop` is requested.
ParallelFor on_all_cores_until(std::stop_token stop);

// Runs `work`; what it runs on all cores gets those that others do not want.
void on_spare_cores(const std::function<void()>& work);

}  // namespace intervale
