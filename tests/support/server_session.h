// A session as the server has it, without a connection: driven by messages that no client of this project sends.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/codec.h"
#include "server/serve/access.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/background.h"
#include "server/serve/catalogue.h"
#include "server/serve/range_cache.h"
#include "server/serve/session_threads.h"

namespace intervale::testing {

// What the sessions of a server share.
struct SharedByServer {
  AtomicSharedPtr<Catalogue> catalogue;
  Memory memory;
  FairScheduler scheduler{1};
  RangeCache ranges{memory, scheduler};
  Background background{scheduler, memory, 1};
  explicit SharedByServer(const std::vector<Catalogue::Volume>& volumes) {
    Catalogue all;
    for (const auto& volume : volumes) EXPECT_TRUE(all.add(volume));
    catalogue.store(std::make_shared<const Catalogue>(std::move(all)));
  }
};

// A session as the server has it, and a client that grants what each batch costs and checks what arrives.
class ServerSession {
 public:
  explicit ServerSession(SharedByServer& shared)
      : threads_(shared.ranges, shared.background, std::make_shared<FairScheduler::Account>()),
        state_(find_granted(shared.catalogue, Scope::everything()), threads_) {
    threads_.set_wake([wake = wake_] {
      const std::lock_guard lock(wake->mutex);
      ++wake->count;
      wake->changed.notify_one();
    });
  }

  // The message as bytes, as a WebSocket session takes it. The code that ends the session; normal: none does.
  protocol::CloseCode send(const protocol::ClientMessage& message) {
    const auto received = protocol::decode_client_message(protocol::encode(message));
    if (!received) return protocol::CloseCode::malformed;
    const auto fault = state_.receive(*received);
    if (fault) {
      EXPECT_NE(fault->text, "");
      EXPECT_LE(fault->text.size(), protocol::kMaxText);
    }
    return fault ? fault->code : protocol::CloseCode::normal;
  }

  protocol::CloseCode open(const std::string& dataset) {
    const protocol::CloseCode code = send(protocol::Open{.dataset = dataset, .credit = protocol::kDefaultWindow});
    EXPECT_TRUE(state_.next());  // Opened
    return code;
  }

  // Until the server has no more to send, or so many messages came. Nothing if that takes too long.
  std::optional<protocol::Done> take_all(int messages = 1 << 20) {
    const auto deadline = Clock::now() + kLongest;
    std::optional<protocol::Done> done;
    while (messages > 0 && Clock::now() < deadline) {
      const auto message = state_.next();
      if (message) {
        take(*message, done);
        --messages;
      } else if (state_.waits()) {
        wake_->wait_until(deadline);
      } else if (!state_.has_work()) {
        return done;
      }
    }
    EXPECT_EQ(messages, 0) << "the stream does not end";
    return {};
  }

  [[nodiscard]] std::uint64_t updates() const { return updates_; }  // that came

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kLongest = std::chrono::seconds(10);  // far more than a view takes, also under the sanitizers
  struct Wake {
    std::mutex mutex;
    std::condition_variable changed;
    int count = 0;
    void wait_until(Clock::time_point deadline) {
      std::unique_lock lock(mutex);
      if (changed.wait_until(lock, deadline, [this] { return count > 0; })) --count;
    }
  };

  void take(const protocol::ServerMessage& message, std::optional<protocol::Done>& done) {
    const auto decoded = protocol::decode_server_message(protocol::encode(message));
    ASSERT_TRUE(decoded) << "clients refuse it: " << decoded.error().message;
    if (const auto* d = std::get_if<protocol::Done>(&message)) {
      EXPECT_FALSE(done) << "a second Done";
      EXPECT_EQ(d->updates_sent, updates_);
      done = *d;
    } else {
      const auto& batch = std::get<protocol::Batch>(message);
      EXPECT_EQ(batch.sequence, sequence_++);
      updates_ += batch.updates;
      EXPECT_EQ(send(protocol::Credit{protocol::cost_of(batch)}), protocol::CloseCode::normal);
    }
  }

  std::shared_ptr<Wake> wake_ = std::make_shared<Wake>();
  SessionThreads threads_;
  SessionState state_;
  std::uint64_t updates_ = 0, sequence_ = 0;
};

}  // namespace intervale::testing
