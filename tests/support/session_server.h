// A server for clients without I/O, at the other end of a connection without delay.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "protocol/codec.h"
#include "server/serve/access.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/catalogue.h"
#include "server/serve/session_threads.h"

namespace intervale::testing {

// Client: a ClientSession, or what is driven like one. The constructor connects it.
template <class Client>
class SessionServer {
 public:
  // find: as of RangeCache.
  SessionServer(const std::shared_ptr<const IntervalVolume>& volume, Client& client, RangeCache::Find find = &PartFinder::find)
      : ranges_(memory_, scheduler_, std::move(find)), client_(client) {
    Catalogue catalogue;
    EXPECT_TRUE(catalogue.add(volume));
    catalogue_.store(std::make_shared<const Catalogue>(std::move(catalogue)));
    threads_.set_wake([this] {
      const std::lock_guard lock(mutex_);
      ++wakes_;
      woken_.notify_one();
    });
    client_.connected(now_);
  }

  // Until neither side has anything to send, or so many messages were sent to the client. may_wait: for as long as the
  // server's measuring of distances takes; otherwise half a second of that is an end, too.
  void run(int messages = 1 << 20, bool may_wait = true) {
    while (messages > 0) {
      ASSERT_NO_FATAL_FAILURE(take_messages());
      auto message = state_.next(2048);
      if (!message && state_.has_work()) continue;
      if (!message && state_.waits()) {
        if (is_woken(may_wait ? std::chrono::seconds(60) : std::chrono::milliseconds(500))) continue;
        EXPECT_FALSE(may_wait) << "the server has forgotten the session";
      }
      if (!message) {
        if (rests_ = !rests_; rests_) state_.rest();  // every other time: what the client sees is the same
        return;
      }
      now_ += std::chrono::milliseconds(1);
      const auto event = client_.receive(protocol::encode(*message), now_);
      ASSERT_TRUE(event) << event.error().message;
      if (event->kind == ClientSession::Event::Kind::opened) resumed_ = !event->is_new_mesh;
      --messages;
    }
  }

  [[nodiscard]] bool resumed() const { return resumed_; }
  [[nodiscard]] const std::vector<protocol::ClientMessage>& received() const { return received_; }

 private:
  void take_messages() {
    for (const auto& bytes : client_.take_messages()) {
      const auto message = protocol::decode_client_message(bytes);
      ASSERT_TRUE(message) << message.error().message;
      received_.push_back(*message);
      const auto fault = state_.receive(*message);
      ASSERT_FALSE(fault) << fault->text;
    }
  }

  // Since the last time, or within that time.
  bool is_woken(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return woken_.wait_for(lock, time, [this] { return wakes_ != 0; }) && wakes_-- != 0;
  }

  AtomicSharedPtr<Catalogue> catalogue_;
  std::mutex mutex_;
  std::condition_variable woken_;
  unsigned wakes_ = 0;
  Memory memory_;
  FairScheduler scheduler_{1};
  RangeCache ranges_;
  Background background_{scheduler_, memory_, 1};
  SessionThreads threads_{ranges_, background_, std::make_shared<FairScheduler::Account>()};
  SessionState state_{find_granted(catalogue_, Scope::everything()), threads_};
  Client& client_;
  std::vector<protocol::ClientMessage> received_;
  bool resumed_ = false, rests_ = false;
  CreditWindow::Clock::time_point now_{};
};

}  // namespace intervale::testing
