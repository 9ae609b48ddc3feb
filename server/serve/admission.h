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
#include <utility>

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

// Connections by address. An IPv6 address counts with its /64, since a host usually has a whole /64.
class AddressCounts {
 public:
  using Key = std::array<std::uint8_t, 9>;  // the IP version, and the first 64 bits of the address
  // Counts one connection while it exists. Movable.
  class Lease {
   public:
    Lease() = default;
    Lease(AddressCounts& counts, const Key& key) : counts_(&counts), key_(key) {}
    Lease(Lease&& other) noexcept : counts_(std::exchange(other.counts_, nullptr)), key_(other.key_) {}
    Lease& operator=(Lease&& other) noexcept {
      const Lease released(std::move(*this));
      counts_ = std::exchange(other.counts_, nullptr);
      key_ = other.key_;
      return *this;
    }
    ~Lease() {
      if (counts_ != nullptr) counts_->release(key_);
    }

   private:
    AddressCounts* counts_ = nullptr;
    Key key_{};
  };

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
 public:
  using Clock = std::chrono::steady_clock;
  explicit WriteBudget(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  WriteBudget(const WriteBudget&) = delete;
  WriteBudget& operator=(const WriteBudget&) = delete;

 private:
  struct Write {
    std::weak_ptr<Connection> connection;
    std::size_t bytes = 0;
    Clock::time_point since;
  };
  using Writes = std::list<Write>;

 public:
  // One pending write. Destroyed when the write has completed or failed.
  class Reservation {
   public:
    Reservation(WriteBudget& budget, Writes::iterator write) : budget_(budget), write_(write) {}
    Reservation(const Reservation&) = delete;
    Reservation& operator=(const Reservation&) = delete;
    ~Reservation() { budget_.release(write_); }

   private:
    WriteBudget& budget_;
    Writes::iterator write_;
  };
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

// The resident memory of the process, from /proc; 0 if it cannot be read. Takes some microseconds.
[[nodiscard]] std::uint64_t resident_bytes();

}  // namespace intervale
