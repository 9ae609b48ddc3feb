#include "server/serve/accounts.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "server/serve/admission.h"
#include "server/serve/header_text.h"

namespace intervale {
namespace {

namespace ip = boost::asio::ip;

constexpr std::chrono::milliseconds kForgotten{1};  // who spent less counts as new

// IPv4 addresses as IPv6 addresses that are mapped.
ip::address_v6::bytes_type bytes_of(const ip::address& address) {
  return (address.is_v6() ? address.to_v6() : ip::make_address_v6(ip::v4_mapped, address.to_v4())).to_bytes();
}

bool have_same_prefix(const ip::address_v6::bytes_type& a, const ip::address_v6::bytes_type& b, unsigned bits) {
  for (unsigned i = 0; i < bits; i += 8) {
    const unsigned mask = bits - i >= 8 ? 0xff : 0xff00u >> (bits - i) & 0xff;
    if (((a[i / 8] ^ b[i / 8]) & mask) != 0) return false;
  }
  return true;
}

}  // namespace

std::shared_ptr<Accounts::Account> Accounts::of_address(const ip::address& address) {
  const AddressKey key = key_of(address);
  return find('a' + std::string(key.begin(), key.end()));
}

std::shared_ptr<Accounts::Account> Accounts::find(std::string key) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Account>& account = accounts_[std::move(key)];
  if (account) return account;
  auto result = account = std::make_shared<Account>();
  if (accounts_.size() >= next_look_) forget_old();
  return result;
}

// Takes as long as there are accounts, and is due when they have doubled.
void Accounts::forget_old() {
  std::erase_if(accounts_, [this](const auto& entry) { return entry.second.use_count() == 1 && scheduler_.spent(*entry.second) < kForgotten; });
  next_look_ = std::max<std::size_t>(64, 2 * accounts_.size());
}

std::size_t Accounts::size() const {
  const std::lock_guard lock(mutex_);
  return accounts_.size();
}

Result<TrustedProxies> TrustedProxies::parse(std::span<const std::string> texts) {
  TrustedProxies result;
  for (const std::string& text : texts) {
    const auto slash = text.find('/');
    boost::system::error_code error;
    const auto address = ip::make_address(text.substr(0, slash), error);
    unsigned bits = address.is_v4() ? 32 : 128;
    const unsigned most = bits;
    bool is_valid = !error;
    if (slash != std::string::npos) {
      const char* const end = text.data() + text.size();
      const auto [stop, failure] = std::from_chars(text.data() + slash + 1, end, bits);
      is_valid = is_valid && failure == std::errc() && stop == end && bits <= most;
    }
    if (!is_valid) return misuse("'" + text + "' is neither an address nor a network, such as 10.0.0.0/8");
    result.networks_.push_back({bytes_of(address), address.is_v4() ? bits + 96 : bits});
  }
  return result;
}

bool TrustedProxies::contains(const ip::address& address) const {
  const auto bytes = bytes_of(address);
  return std::any_of(networks_.begin(), networks_.end(), [&](const Network& n) { return have_same_prefix(bytes, n.prefix, n.bits); });
}

ip::address TrustedProxies::client(const ip::address& peer, std::string_view forwarded_for) const {
  ip::address client = peer;
  while (contains(client) && !forwarded_for.empty()) {
    const auto comma = forwarded_for.rfind(',');
    const std::string_view last = trimmed(forwarded_for.substr(comma == std::string_view::npos ? 0 : comma + 1));
    forwarded_for = forwarded_for.substr(0, comma == std::string_view::npos ? 0 : comma);
    boost::system::error_code error;
    const auto address = ip::make_address(std::string(last), error);
    if (error) break;
    client = address;
  }
  return client;
}

}  // namespace intervale
