// Not installed: the URL of a data set.
#pragma once

#include <string_view>

#include "client/net/url.h"

namespace intervale {

// parse_url() of one that names a data set; misuse of another.
[[nodiscard]] inline Result<ServerUrl> parse_data_set_url(std::string_view text, const Access& access) {
  auto url = parse_url(text, access);
  if (url && url->name.empty()) return misuse("the URL names no data set: expected " + url->server() + "/NAME");
  return url;
}

}  // namespace intervale
