// Where a server is, and which of its data sets is meant.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "common/util/result.h"

namespace intervale {

// How to be let in; no part of a URL.
struct Access {
  std::optional<std::string> token;
  std::optional<std::filesystem::path> authorities;  // PEM: certificates to trust instead of the system's
};

struct ServerUrl {
  std::string host;     // a name or an address, without brackets
  std::string port;     // 1 to 65535, in digits
  std::string name;     // the data set's; empty: none
  bool secure = false;  // TLS
  Access access = {};

  [[nodiscard]] std::string authority() const;  // "localhost:8080", "[::1]:8080"
  [[nodiscard]] std::string server() const { return (secure ? "wss://" : "ws://") + authority(); }
};

// "ws://host:port" or "ws://host:port/name"; wss:// for TLS. An IPv6 address in brackets; port 80, or 443, if there is none. In the name "%20" is a
// space and so on, as browsers write it; a % without two hexadecimal digits behind it is itself. Misuse: anything else.
[[nodiscard]] Result<ServerUrl> parse_url(std::string_view text);

}  // namespace intervale
