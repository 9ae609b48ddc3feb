// A server for clients without I/O, at the other end of a connection without delay.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <semaphore>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "protocol/codec.h"
#include "server/serve/access.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/catalogue.h"
#include "server/serve/session_state.h"

namespace intervale::testing {

// Client: a ClientSession, or what is driven like one. The constructor connects it.
template <class Client>
class SessionServer {
 public:
  // find: as of RangeCache.
  SessionServer(const std::shared_ptr<const IntervalVolume>& volume, Client& client, RangeCache::Find find = &PartFinder::find)
      : ranges_(std::move(find)), client_(client) {
    Catalogue catalogue;
    EXPECT_TRUE(catalogue.add(volume));
    catalogue_.store(std::make_shared<const Catalogue>(std::move(catalogue)));
    state_.set_wake([this] { woken_.release(); });
    client_.connected(now_);
  }

  // Until neither side has anything to send, or so many messages were sent to the client. may_wait: for the server's
  // measuring of distances; otherwise that is an end, too.
  void run(int messages = 1 << 20, bool may_wait = true) {
    while (messages > 0) {
      ASSERT_NO_FATAL_FAILURE(take_messages());
      auto message = state_.next(2048);
      if (!message && state_.has_work()) continue;
      if (!message && state_.waits() && may_wait) {
        woken_.acquire();
        continue;
      }
      if (!message) return;
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

  AtomicSharedPtr<Catalogue> catalogue_;
  std::counting_semaphore<> woken_{0};
  RangeCache ranges_;
  SessionState state_{catalogue_, ranges_, Scope::everything()};
  Client& client_;
  std::vector<protocol::ClientMessage> received_;
  bool resumed_ = false;
  CreditWindow::Clock::time_point now_{};
};

}  // namespace intervale::testing
