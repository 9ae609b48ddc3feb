#include "server/serve/admission.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace intervale {
namespace {

constexpr std::chrono::seconds kMinWriteTime{1};  // before a write counts as slow

}  // namespace

AddressKey key_of(const boost::asio::ip::address& address) {
  AddressKey key{};
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

std::optional<AddressCounts::Lease> AddressCounts::try_acquire(const boost::asio::ip::address& address, std::size_t limit) {
  const Key key = key_of(address);
  const std::lock_guard lock(mutex_);
  std::size_t& count = counts_[key];
  if (count >= limit) return {};  // limit is at least 1, so no count of 0 is left behind
  ++count;
  return Lease(this, {key});
}

void AddressCounts::release(const Key& key) {
  const std::lock_guard lock(mutex_);
  const auto found = counts_.find(key);
  if (--found->second == 0) counts_.erase(found);
}

WriteBudget::Reservation WriteBudget::reserve(std::weak_ptr<Connection> connection, std::size_t bytes, Clock::time_point now) {
  // Until the lock is released: a connection's destructor calls release().
  std::vector<std::shared_ptr<Connection>> keep_alive;
  const std::lock_guard lock(mutex_);
  bytes_ += bytes;
  writes_.push_back({std::move(connection), bytes, now});
  const auto added = std::prev(writes_.end());
  while (bytes_ > max_bytes_ && writes_.front().since + kMinWriteTime < now) {
    Write& oldest = writes_.front();
    bytes_ -= std::exchange(oldest.bytes, 0);
    if (auto slow = oldest.connection.lock()) {
      slow->abort("the limit of unsent bytes is reached, and this client is the slowest reader");
      keep_alive.push_back(std::move(slow));
    }
    aborted_.splice(aborted_.end(), writes_, writes_.begin());
  }
  return Reservation(this, {added});
}

void WriteBudget::release(Writes::iterator write) {
  const std::lock_guard lock(mutex_);
  bytes_ -= write->bytes;
  (write->bytes == 0 ? aborted_ : writes_).erase(write);
}

std::size_t WriteBudget::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace intervale
