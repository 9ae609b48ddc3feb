// Who causes load on a server: an account of processor time for each token or, without one, for each address.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/util/result.h"
#include "server/serve/fair_scheduler.h"

namespace intervale {

// Any thread. An account is kept while sessions have it, and afterwards until what it spent counts no more: to connect
// anew pays nothing back.
class Accounts {
 public:
  using Account = FairScheduler::Account;
  explicit Accounts(FairScheduler& scheduler) : scheduler_(scheduler) {}

  [[nodiscard]] std::shared_ptr<Account> of_token(std::string_view token) { return find('t' + std::string(token)); }
  // An IPv6 address counts with its /64, since a host usually has a whole /64.
  [[nodiscard]] std::shared_ptr<Account> of_address(const boost::asio::ip::address& address);
  [[nodiscard]] std::size_t size() const;

 private:
  [[nodiscard]] std::shared_ptr<Account> find(std::string key);
  void forget_old();
  FairScheduler& scheduler_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Account>> accounts_;
  std::size_t next_look_ = 64;  // accounts at which the next look for old ones is due
};

// The proxies whose X-Forwarded-For is believed: addresses and networks, such as 10.0.0.0/8 and fd00::/8.
class TrustedProxies {
 public:
  TrustedProxies() = default;
  // Fails, naming the first text that is neither an address nor a network.
  static Result<TrustedProxies> parse(std::span<const std::string> texts);
  [[nodiscard]] bool contains(const boost::asio::ip::address& address) const;

  // The address of the client: the peer's, or, if that is a trusted proxy, the last one of X-Forwarded-For that is not a
  // trusted proxy's. The header's fields in order, joined by commas; a text that is no address ends the search.
  [[nodiscard]] boost::asio::ip::address client(const boost::asio::ip::address& peer, std::string_view forwarded_for) const;

 private:
  struct Network {
    boost::asio::ip::address_v6::bytes_type prefix;
    unsigned bits = 128;
  };
  std::vector<Network> networks_;
};

}  // namespace intervale
