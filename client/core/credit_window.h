// Flow control on the client's side: how much credit to grant the server. See PROTOCOL.md, "Credit".
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "protocol/limits.h"

namespace intervale {

// A window of outstanding credit. It is granted again as batches arrive, until the byte budget is used up.
//
// The window bounds how many bytes of an old view can still arrive after the view changed. So it follows the
// connection: it is twice the bandwidth-delay product, with the session's shortest round trip plus kSlack as the delay.
// Without the factor 2 it would keep the connection busy too, but could never measure a higher bandwidth.
class CreditWindow {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kSlack{60};
  static constexpr std::uint64_t kMinWindow = 32 << 10, kMaxWindow = 4 << 20;  // of a window that adapts

  // budget: bytes to grant in all; UINT64_MAX for no limit. window: the most that is outstanding, from 4 kMinCredit to
  // protocol::kMaxWindow; without it the window starts at kDefaultWindow and adapts to the connection.
  explicit CreditWindow(std::uint64_t budget, std::optional<std::uint64_t> window = {})
      : budget_left_(budget), window_(window.value_or(protocol::kDefaultWindow)), is_fixed_(window.has_value()) {}

  // The grant that a session starts with: the whole window.
  [[nodiscard]] std::uint64_t grant_window() { return grant(window_); }
  // The next grant, 0 for none; to be called until it is 0. A quarter of the window at a time: smaller grants cost a
  // message each, and for a larger one the server would send everything at once and then wait.
  [[nodiscard]] std::uint64_t grant_more() { return grant((window_ + 3) / 4); }
  // A batch of that cost arrived. False: the server sent more than it was granted.
  [[nodiscard]] bool spend(std::uint64_t cost) {
    if (cost > outstanding_) return false;
    outstanding_ -= cost;
    return true;
  }

  // Measurements of the connection. Of the round trips of a session the least counts.
  void note_round_trip(Clock::duration time) { round_trip_ = std::min(round_trip_, time); }
  void note_batch(std::uint64_t cost, Clock::time_point now) {
    if (is_fixed_) return;
    if (!measured_since_) {  // it is not known how long the first batch took
      measured_since_ = now;
      bytes_ = 0;
      return;
    }
    bytes_ += cost;
    const Clock::duration time = now - *measured_since_;
    if (time < std::max(round_trip_, kMinMeasurement)) return;
    const double seconds = std::chrono::duration<double>(time).count(), rate = double(bytes_) / seconds;
    rate_ = rate > rate_ ? rate : rate_ + (rate - rate_) / 4;
    const double window = 2 * rate_ * std::chrono::duration<double>(round_trip_ + kSlack).count();
    window_ = std::uint64_t(std::clamp(window, double(kMinWindow), double(kMaxWindow)));
    measured_since_ = now;
    bytes_ = 0;
  }
  // Nothing more is on its way: the time until the next batch does not count.
  void note_pause() { measured_since_.reset(); }

  // The session is over: credit that was not spent returns to the budget.
  void end_session() {
    budget_left_ += outstanding_;
    outstanding_ = 0;
    round_trip_ = kMaxRoundTrip;
    note_pause();
  }
  // No batch will come.
  [[nodiscard]] bool is_exhausted() const { return budget_left_ == 0 && outstanding_ < protocol::kMinCredit; }
  [[nodiscard]] std::uint64_t window() const { return window_; }

 private:
  // A portion, or the rest of the budget if that is less; 0 while it does not fit into the window.
  [[nodiscard]] std::uint64_t grant(std::uint64_t portion) {
    const std::uint64_t bytes = std::min({window_ - std::min(window_, outstanding_), budget_left_, portion});
    if (bytes < portion && bytes < budget_left_) return 0;
    budget_left_ -= bytes;
    outstanding_ += bytes;
    return bytes;
  }
  static constexpr Clock::duration kMaxRoundTrip = std::chrono::seconds(3), kMinMeasurement = std::chrono::milliseconds(20);
  std::uint64_t budget_left_;
  std::uint64_t window_;
  bool is_fixed_;
  std::uint64_t outstanding_ = 0;
  Clock::duration round_trip_ = kMaxRoundTrip;
  std::optional<Clock::time_point> measured_since_;
  std::uint64_t bytes_ = 0;  // since then
  double rate_ = 0;          // bytes a second
};

}  // namespace intervale
