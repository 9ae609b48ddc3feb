#include "client/net/url.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>

namespace intervale {
namespace {

bool is_host(std::string_view host, bool bracketed) {
  if (bracketed && host.find(':') == std::string_view::npos) return false;  // only an IPv6 address has brackets
  return !host.empty() && std::all_of(host.begin(), host.end(), [bracketed](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || (bracketed ? c == ':' || c == '%' : c == '-' || c == '_');
  });
}

bool is_port(std::string_view port) {
  std::uint16_t number = 0;
  const auto [stop, failure] = std::from_chars(port.data(), port.data() + port.size(), number);
  return failure == std::errc() && stop == port.data() + port.size() && number != 0;
}

// "a%20b" becomes "a b"; a % that starts no escape stays.
std::string percent_decoded(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char byte = 0;
    const std::string_view digits = text[i] == '%' ? text.substr(i + 1, 2) : std::string_view();
    const bool escape = digits.size() == 2 && std::from_chars(digits.data(), digits.data() + 2, byte, 16).ptr == digits.data() + 2;
    plain += escape ? static_cast<char>(byte) : text[i];
    i += escape ? 2 : 0;
  }
  return plain;
}

}  // namespace

std::string ServerUrl::authority() const { return (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + port; }

Result<ServerUrl> parse_url(std::string_view text, Access access) {
  const auto wrong = [text](const char* what) {
    return misuse("invalid URL '" + std::string(text) + "': " + what + "; expected ws://host:port or ws://host:port/name");
  };
  ServerUrl url;
  url.access = std::move(access);
  url.secure = text.starts_with("wss://");
  if (!url.secure && !text.starts_with("ws://")) return wrong("it does not begin with ws:// or wss://");
  std::string_view rest = text.substr(text.find("//") + 2);
  if (const auto slash = rest.find('/'); slash != std::string_view::npos) {
    url.name = rest.substr(slash + 1);
    rest = rest.substr(0, slash);
  }
  if (!url.name.empty() && url.name.back() == '/') url.name.pop_back();
  url.name = percent_decoded(url.name);
  if (url.name.find('/') != std::string::npos) return wrong("the name of a data set has no slash");

  const bool bracketed = rest.starts_with('[');
  const auto end = bracketed ? rest.find(']') : rest.find(':');
  if (bracketed && end == std::string_view::npos) return wrong("a closing bracket is missing");
  url.host = bracketed ? rest.substr(1, end - 1) : rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(bracketed ? end + 1 : end);
  url.port = rest.empty() ? (url.secure ? "443" : "80") : std::string(rest.substr(1));
  if (!is_host(url.host, bracketed)) return wrong("the host is neither a name nor an address");
  if ((!rest.empty() && rest.front() != ':') || !is_port(url.port)) return wrong("the port is not 1 to 65535");
  return url;
}

}  // namespace intervale
