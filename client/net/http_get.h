// One HTTP request to a server. Blocks, never for longer than its deadlines.
#pragma once

#include <string>

#include "client/net/url.h"
#include "common/util/result.h"

namespace intervale {

// The body that GET of target gives, at most 16 MiB. Failures: no connection within 5 s, a certificate that is not trusted, no answer within 10 s
// more, a server that is not one of ours, a token that is wanted or does not do, a status other than 200.
[[nodiscard]] Result<std::string> http_get(const ServerUrl& url, const std::string& target);

}  // namespace intervale
