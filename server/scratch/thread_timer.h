// A signal to one thread, again and again.
#pragma once

#include <signal.h>
#include <time.h>

#include <chrono>
#include <optional>

namespace intervale {

class ThreadTimer {
 public:
  // To the calling thread, every `period` of real time, until this is destroyed, by whatever thread. There is none if the
  // system has no timer left.
  ThreadTimer(int signal, std::chrono::nanoseconds period);
  ThreadTimer(const ThreadTimer&) = delete;
  ThreadTimer& operator=(const ThreadTimer&) = delete;
  ~ThreadTimer();

 private:
  std::optional<timer_t> timer_;
};

// Keeps one signal from the calling thread. It is delivered afterwards.
class SignalBlock {
 public:
  explicit SignalBlock(int signal);
  SignalBlock(const SignalBlock&) = delete;
  SignalBlock& operator=(const SignalBlock&) = delete;
  ~SignalBlock();

 private:
  sigset_t before_{};
};

}  // namespace intervale
