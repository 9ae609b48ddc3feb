// Where a server is, and which of its data sets is meant.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/result.h"

namespace intervale {

// How to be let in; no part of a URL.
struct Access {
  std::optional<std::string> token;
};

struct ServerUrl {
  std::string host;  // a name or an address, without brackets
  std::string port;  // 1 to 65535, in digits
  std::string name;  // the data set's; empty: none
  Access access = {};

  [[nodiscard]] std::string authority() const;  // "localhost:8080", "[::1]:8080"
  [[nodiscard]] std::string server() const { return "ws://" + authority(); }
};

// "ws://host:port" or "ws://host:port/name"; an IPv6 address in brackets; port 80 if there is none. Misuse: anything else, wss:// too, for there is
// no TLS.
[[nodiscard]] Result<ServerUrl> parse_url(std::string_view text);

}  // namespace intervale
