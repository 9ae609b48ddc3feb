// Whether, and when, a client that lost its server tries again to reach it.
#pragma once

#include <chrono>
#include <optional>
#include <random>

#include "client/core/backoff.h"
#include "client/core/client_session.h"

namespace intervale {

// A server that is reached again and opens the data set, but sends nothing new before it ends the session, has not been
// reached.
class Reconnecting {
 public:
  using Clock = std::chrono::steady_clock;

  // time: how long, from each loss.
  explicit Reconnecting(std::chrono::milliseconds time) : time_(time) {}

  void connected() { was_opened_ = false; }
  void received(const ClientSession::Event& event) {
    was_opened_ = was_opened_ || event.kind != ClientSession::Event::Kind::none;
    has_progress_ = has_progress_ || event.updates > 0 || event.kind == ClientSession::Event::Kind::done;
  }
  // The connection was lost. Whether the time begins anew.
  bool lost(Clock::time_point now = Clock::now()) {
    if (!has_progress_ && was_opened_) return false;
    has_progress_ = false;
    deadline_ = now + time_;
    backoff_ = Backoff(std::random_device{}());
    return true;
  }
  // Until the next attempt; nullopt: the time is over.
  [[nodiscard]] std::optional<std::chrono::milliseconds> pause(Clock::time_point now = Clock::now()) {
    const auto pause = backoff_.next();
    if (now + pause > deadline_) return std::nullopt;
    return pause;
  }

 private:
  std::chrono::milliseconds time_;
  bool was_opened_ = false;   // over the last connection
  bool has_progress_ = true;  // since it was lost last: updates came, or the end of the stream
  Clock::time_point deadline_{};
  Backoff backoff_{0};
};

}  // namespace intervale
