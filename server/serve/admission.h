// What a server limits besides its number of connections: message rates, connections by address, unsent bytes. Any
// thread, except RateLimit.
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

#include "server/serve/connections.h"

namespace intervale {

// A rate, with a burst of one second's worth after a second of silence. One thread.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;
  explicit RateLimit(double per_second) : period_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / per_second))) {}

  // Counts one event, and returns how long the caller has to wait before it handles it.
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

// The IP version, and the first 64 bits of the address: a host usually has a whole /64 of IPv6. A mapped IPv4 address is an
// IPv4 address.
using AddressKey = std::array<std::uint8_t, 9>;
[[nodiscard]] AddressKey key_of(const boost::asio::ip::address& address);

// Connections by address.
class AddressCounts {
 public:
  using Key = AddressKey;
  struct Release {
    Key key{};
    void operator()(AddressCounts* counts) const { counts->release(key); }
  };
  // Counts one connection while it exists.
  using Lease = std::unique_ptr<AddressCounts, Release>;

  // nullopt if there are `limit` (at least 1) already.
  std::optional<Lease> try_acquire(const boost::asio::ip::address& address, std::size_t limit);

 private:
  void release(const Key& key);
  std::mutex mutex_;
  std::map<Key, std::size_t> counts_;
};

// Bounds the unsent bytes of all sessions. Past the limit, the connections whose writes have been pending the longest
// are aborted, if that is more than a second.
class WriteBudget {
  using Clock = std::chrono::steady_clock;
  struct Write {
    std::weak_ptr<Connection> connection;
    std::size_t bytes = 0;
    Clock::time_point since;
  };
  using Writes = std::list<Write>;
  struct Release {
    Writes::iterator write;
    void operator()(WriteBudget* budget) const { budget->release(write); }
  };

 public:
  explicit WriteBudget(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // One pending write. Destroyed when the write has completed or failed.
  using Reservation = std::unique_ptr<WriteBudget, Release>;
  [[nodiscard]] Reservation reserve(std::weak_ptr<Connection> connection, std::size_t bytes, Clock::time_point now = Clock::now());
  [[nodiscard]] std::size_t bytes() const;

 private:
  void release(Writes::iterator write);
  mutable std::mutex mutex_;
  std::size_t max_bytes_;
  std::size_t bytes_ = 0;  // of writes_
  Writes writes_;          // oldest first
  Writes aborted_;         // of connections that were told to abort; their bytes are 0
};

}  // namespace intervale
