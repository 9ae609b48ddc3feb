// Progress of long work: one line on a terminal, nothing in a pipe.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace intervale {

// A line on stderr that rewrites itself, at most ten times a second, and is wiped when this goes. Any thread may call.
class Progress {
 public:
  explicit Progress(std::string what);  // what is being done: "building tooth"
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void fraction(double done);           // 0 to 1
  void text(const std::string& state);  // anything short
  void note(const std::string& line);   // a line that stays, also in a pipe
  [[nodiscard]] bool is_seen() const { return terminal_; }

 private:
  void show_locked(const std::string& state);
  std::string what_;
  bool terminal_;
  std::mutex mutex_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace intervale
