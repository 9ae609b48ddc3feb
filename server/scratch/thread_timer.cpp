#include "server/scratch/thread_timer.h"

#include <pthread.h>
#include <unistd.h>

namespace intervale {

ThreadTimer::ThreadTimer(int signal, std::chrono::nanoseconds period) {
  sigevent event{};
  event.sigev_notify = SIGEV_THREAD_ID;
  event.sigev_signo = signal;
  event._sigev_un._tid = ::gettid();
  timer_t timer{};
  if (::timer_create(CLOCK_MONOTONIC, &event, &timer) != 0) return;
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(period);
  const timespec time{seconds.count(), (period - seconds).count()};
  const itimerspec times{time, time};
  ::timer_settime(timer, 0, &times, nullptr);
  timer_ = timer;
}

ThreadTimer::~ThreadTimer() {
  if (timer_) ::timer_delete(*timer_);
}

SignalBlock::SignalBlock(int signal) {
  sigset_t one{};
  sigemptyset(&one);
  sigaddset(&one, signal);
  ::pthread_sigmask(SIG_BLOCK, &one, &before_);
}

SignalBlock::~SignalBlock() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

}  // namespace intervale
