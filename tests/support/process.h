// A program run by a test.
#pragma once

#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace intervale {

struct Finished {
  int status = -1;  // exit status; 128 + the signal for one that was killed
  std::string out;
  std::string err;
};

// Kills what still runs at its end. One thread, but for signal().
class Process {
 public:
  explicit Process(const std::vector<std::string>& arguments);  // the first is the program's path
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process();

  [[nodiscard]] int id() const { return pid_; }  // while it runs
  void signal(int number) const;

  // Reads what the program says on stderr until `text` is among it; what was said so far, or nothing if the program
  // ended or took longer than 60 s.
  std::optional<std::string> wait_for(const std::string& text);

  // Until the program ends; a program that takes longer than 120 s is killed.
  Finished wait();

 private:
  bool pump(std::chrono::steady_clock::time_point until);  // false: both streams ended, or time is up
  std::atomic<int> pid_ = -1;                              // -1: reaped
  int out_ = -1;
  int err_ = -1;
  Finished result_;
};

[[nodiscard]] Finished run(const std::vector<std::string>& arguments);

}  // namespace intervale
