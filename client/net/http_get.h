// One HTTP request to a server. Blocks, never for longer than its deadlines.
#pragma once

#include <string>

#include "client/net/url.h"
#include "common/util/result.h"

namespace intervale {

// The body of the answer to GET target, at most 16 MiB. Fails without a connection within 5 s, without an answer within
// another 10 s, and on a certificate that is not trusted, a server that is not intervale, a missing or refused token,
// or a status other than 200.
[[nodiscard]] Result<std::string> http_get(const ServerUrl& url, const std::string& target);

}  // namespace intervale
