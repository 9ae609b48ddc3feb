// What an HTTP request is for: RFC 9112, section 3.2.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace intervale {

struct RequestTarget {
  std::string target;  // a path and its query, or whatever else the request line had
  std::string host;    // with its port; empty if the request names none
};

// target: as in the request line. An http or https URL is taken apart, and its host counts, not that of the Host field.
// hosts: the values of all Host fields. version: 10 or 11.
// nullopt: HTTP/1.1 without Host; more than one; one that is no host and port; a URL without a host.
[[nodiscard]] std::optional<RequestTarget> request_target(std::string_view target, std::span<const std::string_view> hosts, unsigned version);

}  // namespace intervale
