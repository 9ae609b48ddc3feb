// A stream without a server: the data set is in memory, and what a view needs is chosen here, by the code of the server.
#pragma once

#include <memory>

#include "client/core/fetch_session.h"
#include "common/ivm/interval_volume.h"
#include "common/util/result.h"

namespace intervale {

// As fetch() from a server that serves this data set, and with the same mesh. max_bytes is of the messages that such a
// server would send; what has no meaning without a connection is ignored. One thread.
[[nodiscard]] Result<Fetched> fetch_local(const std::shared_ptr<const IntervalVolume>& volume, const FetchOptions& options,
                                          const FetchEvents& events);

}  // namespace intervale
