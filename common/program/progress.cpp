#include "common/program/progress.h"

#include <fmt/core.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>

namespace intervale {

Progress::Progress(std::string what) : what_(std::move(what)), terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (shown_) std::fputs("\r\x1b[K", stderr);
}

void Progress::fraction(double done) {
  if (terminal_) text(fmt::format("{:3.0f} %", 100 * done));
}

void Progress::text(const std::string& state) {
  if (!terminal_) return;
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  fmt::print(stderr, "\r{}: {}\x1b[K", what_, state);
  std::fflush(stderr);
  shown_ = true;
}

void Progress::note(const std::string& line) {
  const std::lock_guard lock(mutex_);
  fmt::print(stderr, "{}{}\n", shown_ ? "\r\x1b[K" : "", line);
  shown_ = false;
}

ParallelFor with_progress(Progress& progress, const ParallelFor& parallel) {
  if (!progress.is_seen()) return parallel;
  return [&progress, parallel, steps = std::make_shared<int>(0)](std::size_t count, const std::function<void(std::size_t)>& piece) {
    const int step = ++*steps;  // of all copies
    std::atomic<std::size_t> done = 0;
    parallel(count, [&](std::size_t i) {
      piece(i);
      progress.text(fmt::format("step {}, {:.0f} %", step, 100 * double(++done) / double(count)));
    });
  };
}

}  // namespace intervale
