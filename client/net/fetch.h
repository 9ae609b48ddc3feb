// A whole stream: from a URL and a level of detail to a mesh.
#pragma once

#include "client/core/fetch_session.h"
#include "client/net/url.h"
#include "common/util/result.h"

namespace intervale {

// Connects, and receives until everything has arrived or a budget is reached. When the server is lost, connects again
// after the pauses of Backoff, and resumes; if the data changed, starts again. Every other failure is an error that
// names the server.
Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events);

}  // namespace intervale
