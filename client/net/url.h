// The URL of a server or of one of its data sets.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

// Access to a server; not part of the URL.
struct Access {
  std::optional<std::string> token;
  std::optional<std::filesystem::path> authorities;  // PEM file of certificates to trust instead of the system's
};

struct ServerUrl {
  std::string host;     // a name or an address, without brackets
  std::string port;     // 1 to 65535, in digits
  std::string name;     // of the data set; empty: none is given
  bool secure = false;  // TLS
  Access access = {};

  [[nodiscard]] INTERVALE_EXPORT std::string authority() const;  // "localhost:8080", "[::1]:8080"
  [[nodiscard]] std::string server() const { return (secure ? "wss://" : "ws://") + authority(); }
};

// Parses "ws://host:port" or "ws://host:port/name"; wss:// for TLS. An IPv6 address is in brackets. The default port is
// 80, or 443 with TLS. The name is percent-decoded; a % without two hexadecimal digits after it stays. Anything else is
// Error::usage. access: of the result.
[[nodiscard]] INTERVALE_EXPORT Result<ServerUrl> parse_url(std::string_view text, Access access = {});

}  // namespace intervale
