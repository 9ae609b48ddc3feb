#include "server/serve/guard.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>
#include <vector>

namespace intervale {
namespace {

constexpr std::chrono::seconds kPatience{1};

AddressCounts::Key key_of(const boost::asio::ip::address& address) {
  AddressCounts::Key key{};
  if (address.is_v6() && !address.to_v6().is_v4_mapped()) {
    const auto bytes = address.to_v6().to_bytes();
    key[0] = 6;
    std::copy_n(bytes.begin(), 8, key.begin() + 1);
  } else {
    const auto v4 = address.is_v4() ? address.to_v4() : boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, address.to_v6());
    const auto bytes = v4.to_bytes();
    key[0] = 4;
    std::copy_n(bytes.begin(), 4, key.begin() + 1);
  }
  return key;
}

}  // namespace

std::optional<AddressCounts::Seat> AddressCounts::enter(const boost::asio::ip::address& address, std::size_t most) {
  const Key key = key_of(address);
  const std::lock_guard lock(mutex_);
  std::size_t& count = counts_[key];
  if (count >= most) return {};  // most is 1 at least, so no empty count is left behind
  ++count;
  return Seat(*this, key);
}

void AddressCounts::leave(const Key& key) {
  const std::lock_guard lock(mutex_);
  const auto at = counts_.find(key);
  if (--at->second == 0) counts_.erase(at);
}

Outbox::Leaving Outbox::add(std::weak_ptr<Connection> of, std::size_t bytes, Clock::time_point now) {
  std::vector<std::shared_ptr<Connection>> told;  // outlives the lock: its destructor may come here
  const std::lock_guard lock(mutex_);
  bytes_ += bytes;
  messages_.push_back({std::move(of), bytes, now});
  const auto mine = std::prev(messages_.end());
  while (bytes_ > most_ && messages_.front().since + kPatience < now) {
    bytes_ -= messages_.front().bytes;
    if (auto connection = messages_.front().of.lock()) {
      connection->drop();
      told.push_back(std::move(connection));
    }
    messages_.front().bytes = 0;
    cut_.splice(cut_.end(), messages_, messages_.begin());
  }
  return {*this, mine};
}

void Outbox::left(Messages::iterator at) {
  const std::lock_guard lock(mutex_);
  bytes_ -= at->bytes;
  (at->bytes == 0 ? cut_ : messages_).erase(at);
}

std::size_t Outbox::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::uint64_t resident_bytes() {
  unsigned long pages = 0;
  if (std::FILE* const file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%*s %lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return std::uint64_t(pages) * std::uint64_t(::sysconf(_SC_PAGESIZE));
}

}  // namespace intervale
