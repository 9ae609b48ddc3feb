// How long a session's views take: until something is sent for them, and in work.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "server/serve/metrics.h"

namespace intervale {

// One thread.
class ViewTiming {
 public:
  using Clock = std::chrono::steady_clock;

  void on_view(std::uint64_t epoch) {
    newest_ = {epoch, Clock::now()};
    work_ = Clock::duration(0);
    if (!oldest_) oldest_ = newest_;
  }

  // A message for the view of that epoch was sent.
  void on_sent(std::uint64_t epoch, Metrics& metrics) {
    if (!oldest_ || epoch < oldest_->epoch) return;
    const auto time = Clock::now() - oldest_->since;
    std::exchange(first_is_answered_, true) ? metrics.observe_view_change(time) : metrics.observe_first_mesh(time);
    oldest_.reset();
    if (newest_.epoch > epoch) oldest_ = newest_;
  }

  // Work for the newest view.
  void add_work(Clock::duration time) { work_ += time; }
  [[nodiscard]] Clock::duration work() const { return work_; }
  [[nodiscard]] bool has_view() const { return newest_.since != Clock::time_point(); }

 private:
  struct View {
    std::uint64_t epoch = 0;
    Clock::time_point since;
  };
  // The oldest and the newest view that nothing was sent for yet.
  std::optional<View> oldest_;
  View newest_;
  Clock::duration work_{0};
  bool first_is_answered_ = false;
};

}  // namespace intervale
