// Progress of long work: one line on a terminal, nothing if stderr is not a terminal.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "common/util/parallel.h"

namespace intervale {

// A line on stderr, rewritten at most ten times a second, and erased on destruction. Any thread.
class Progress {
 public:
  explicit Progress(std::string what);  // the work: "building tooth"
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void fraction(double done);           // 0 to 1
  void text(const std::string& state);  // any short text
  void note(const std::string& line);   // prints a line that stays, also without a terminal
  [[nodiscard]] bool is_seen() const { return terminal_; }

 private:
  std::string what_;
  bool terminal_;
  std::mutex mutex_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_{};
};

// A ParallelFor that does as `parallel`, and shows which of its loops one after the other runs, and how much of it is
// done. One loop at a time. progress must outlive it.
[[nodiscard]] ParallelFor with_progress(Progress& progress, const ParallelFor& parallel);

}  // namespace intervale
