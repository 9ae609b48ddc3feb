#include "server/serve/request_target.h"

#include <algorithm>
#include <array>
#include <boost/algorithm/string/predicate.hpp>
#include <cctype>

namespace intervale {
namespace {

constexpr std::array<std::string_view, 2> kSchemes{"http://", "https://"};
constexpr std::string_view kHostMarks = "-._~!$&'()*+,;=:[]%";

// Of the characters of hosts and ports (RFC 3986, section 3.2.2). User information has a '@'.
bool is_host(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return (c < 0x80 && std::isalnum(c) != 0) || kHostMarks.find(char(c)) != std::string_view::npos; });
}

}  // namespace

std::optional<RequestTarget> request_target(std::string_view target, std::span<const std::string_view> hosts, unsigned version) {
  if (hosts.size() > 1 || (hosts.empty() && version >= 11)) return {};
  const std::string_view host = hosts.empty() ? std::string_view() : hosts.front();
  if (!is_host(host)) return {};
  const auto scheme = std::find_if(kSchemes.begin(), kSchemes.end(), [target](auto s) { return boost::algorithm::istarts_with(target, s); });
  if (scheme == kSchemes.end()) return RequestTarget{std::string(target), std::string(host)};
  target.remove_prefix(scheme->size());
  const std::string_view authority = target.substr(0, target.find_first_of("/?#"));
  target.remove_prefix(authority.size());
  if (authority.empty() || !is_host(authority)) return {};
  return RequestTarget{target.starts_with('/') ? std::string(target) : "/" + std::string(target), std::string(authority)};
}

}  // namespace intervale
