// How much the server may send, seen from the client.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "protocol/limits.h"

namespace intervale {

// A window that is opened again as batches are applied, and closes as the budget runs out.
//
// What is under way when the view changes is of the old view: the window bounds it. So it goes by the line: twice what that carries within a round
// trip and kSlack. Half of that would do, were grants not saved up, and it would never find out that the line carries more.
class Grants {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kSlack{60};
  static constexpr std::uint64_t kLeastWindow = 32 << 10, kMostWindow = 4 << 20;

  // budget: bytes in all; UINT64_MAX for no limit. window: most that is outstanding, 4 kMinCredit to kMaxWindow; without one it begins with
  // kDefaultWindow and goes by the line.
  explicit Grants(std::uint64_t budget, std::optional<std::uint64_t> window = {})
      : left_(budget), window_(window.value_or(protocol::kDefaultWindow)), is_fixed_(window.has_value()) {}

  // What to grant as a session begins: the whole window.
  [[nodiscard]] std::uint64_t take_all() { return take(window_); }
  // What to grant now, 0 for nothing; to be asked until it is that. A quarter of the window at a time: small grants are saved up, for each is a
  // message, and large ones would have the server send all in one, and wait.
  [[nodiscard]] std::uint64_t take() { return take((window_ + 3) / 4); }
  [[nodiscard]] bool spend(std::uint64_t cost) {  // false: the server sent more than it was granted
    if (cost > outstanding_) return false;
    outstanding_ -= cost;
    return true;
  }

  // The line: a question and its answer took so long, of which the least counts; a batch is applied; and nothing more is under way for now.
  void round_trip(Clock::duration time) { round_trip_ = std::min(round_trip_, time); }
  void applied(std::uint64_t bytes, Clock::time_point now);
  void pause() { since_.reset(); }

  // A session is over, and what was granted in it.
  void forget_outstanding() {
    left_ += outstanding_;
    outstanding_ = 0;
    round_trip_ = kLongest;
    pause();
  }
  [[nodiscard]] bool exhausted() const { return left_ == 0 && outstanding_ < protocol::kMinCredit; }  // nothing more will come
  [[nodiscard]] std::uint64_t window() const { return window_; }

 private:
  [[nodiscard]] std::uint64_t take(std::uint64_t portion) {
    const std::uint64_t wish = std::min({window_ - std::min(window_, outstanding_), left_, portion});
    if (wish < portion && wish < left_) return 0;
    left_ -= wish;
    outstanding_ += wish;
    return wish;
  }
  static constexpr Clock::duration kLongest = std::chrono::seconds(3), kShortest = std::chrono::milliseconds(20);  // to measure a rate over
  std::uint64_t left_;
  std::uint64_t window_;
  bool is_fixed_;
  std::uint64_t outstanding_ = 0;
  Clock::duration round_trip_ = kLongest;
  std::optional<Clock::time_point> since_;  // what came after then is counted
  std::uint64_t bytes_ = 0;
  double rate_ = 0;  // bytes a second
};

}  // namespace intervale
