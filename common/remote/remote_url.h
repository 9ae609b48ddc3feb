// The URL of a file on a web server or in an object store.
#pragma once

#include <string>
#include <string_view>

#include "common/util/result.h"

namespace intervale {

struct RemoteUrl {
  std::string text;    // all that is requested: with the query, without a fragment
  std::string origin;  // "https://host:443": always with the port
  std::string shown;   // for people and logs: without the query, which may be a signature
  std::string name;    // of the data set: the last part of the path, decoded, without .ivm
  bool secure = false;
};

// Whether it is meant as one: it begins with http:// or https://.
[[nodiscard]] bool is_remote_url(std::string_view text);

// For people and logs: a URL without its query, which may be a signature; anything else as it is.
[[nodiscard]] std::string shown_url(std::string_view text);

// Anything but http://host… and https://host… is misuse, and so are a user or a password in it, and a path that names no
// file. What is not allowed in a URL, such as a space, must be percent-encoded.
[[nodiscard]] Result<RemoteUrl> parse_remote_url(std::string_view text);

// Where the answer from `url` redirects to. location: the header's value, from outside; it may be relative. Fails if that
// is no such URL, or not https where `url` is.
[[nodiscard]] Result<RemoteUrl> redirected(const RemoteUrl& url, const std::string& location);

}  // namespace intervale
