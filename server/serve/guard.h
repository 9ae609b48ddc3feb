// What a server bounds besides its queue of connections: how fast, how many from one address, how much waits to leave. Any thread, but for RateLimit.
#pragma once

#include <array>
#include <boost/asio/ip/address.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "server/serve/connections.h"

namespace intervale {

// So many a second, and as many at once after a second of silence. One thread.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;
  explicit RateLimit(double per_second) : period_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / per_second))) {}

  // Counts one more; how long it has to wait.
  Clock::duration take(Clock::time_point now) {
    constexpr Clock::duration kBurst = std::chrono::seconds(1);
    if (next_ < now - kBurst) next_ = now - kBurst;
    next_ += period_;
    return next_ > now ? next_ - now : Clock::duration(0);
  }

 private:
  Clock::duration period_;
  Clock::time_point next_{};
};

// Connections by address; of IPv6, by the first 64 bits, for whoever has one address of those has all.
class AddressCounts {
 public:
  using Key = std::array<std::uint8_t, 9>;
  // One connection, until it goes. May be moved.
  class Seat {
   public:
    Seat() = default;
    Seat(AddressCounts& counts, const Key& key) : counts_(&counts), key_(key) {}
    Seat(Seat&& other) noexcept : counts_(std::exchange(other.counts_, nullptr)), key_(other.key_) {}
    Seat& operator=(Seat&& other) noexcept {
      const Seat left(std::move(*this));
      counts_ = std::exchange(other.counts_, nullptr);
      key_ = other.key_;
      return *this;
    }
    ~Seat() {
      if (counts_ != nullptr) counts_->leave(key_);
    }

   private:
    AddressCounts* counts_ = nullptr;
    Key key_{};
  };

  // Nothing if there are `most` already.
  std::optional<Seat> enter(const boost::asio::ip::address& address, std::size_t most);

 private:
  void leave(const Key& key);
  std::mutex mutex_;
  std::map<Key, std::size_t> counts_;
};

// Messages that are leaving. Past the limit, those that have been leaving the longest are cut off with their connections, once that is a second.
class Outbox {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Outbox(std::size_t most_bytes) : most_(most_bytes) {}
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

 private:
  struct Message {
    std::weak_ptr<Connection> of;
    std::size_t bytes = 0;
    Clock::time_point since;
  };
  using Messages = std::list<Message>;

 public:
  // One message, until it has left.
  class Leaving {
   public:
    Leaving(Outbox& outbox, Messages::iterator at) : outbox_(outbox), at_(at) {}
    Leaving(const Leaving&) = delete;
    Leaving& operator=(const Leaving&) = delete;
    ~Leaving() { outbox_.left(at_); }

   private:
    Outbox& outbox_;
    Messages::iterator at_;
  };
  [[nodiscard]] Leaving add(std::weak_ptr<Connection> of, std::size_t bytes, Clock::time_point now = Clock::now());
  [[nodiscard]] std::size_t bytes() const;

 private:
  void left(Messages::iterator at);
  mutable std::mutex mutex_;
  std::size_t most_;
  std::size_t bytes_ = 0;
  Messages messages_;  // oldest first
  Messages cut_;       // told to go; they count no more
};

// The process' memory that is in use, as the kernel counts it; 0 if it does not say. Takes some microseconds.
[[nodiscard]] std::uint64_t resident_bytes();

}  // namespace intervale
