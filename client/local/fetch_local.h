// A stream without a server: the data set is in memory, and what a view needs is chosen here, by the code of the server.
#pragma once

#include <functional>
#include <memory>

#include "client/core/fetch_session.h"
#include "common/ivm/interval_volume.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// As fetch() from a server that serves this data set, and with the same mesh. max_bytes is of the messages that such a
// server would send; what has no meaning without a connection is ignored. One thread.
[[nodiscard]] Result<Fetched> fetch_local(const std::shared_ptr<const IntervalVolume>& volume, const FetchOptions& options,
                                          const FetchEvents& events);

// Reads a data set on: as far as its next scale, or all of it; the last time IntervalVolume::is_whole(). Another content_hash
// tells that it has changed meanwhile. May be called on another thread, by one at a time; `parallel` may stop it.
enum class ReadOn { one_scale, all };
using NextVolume = std::function<Result<std::shared_ptr<const IntervalVolume>>(ReadOn how, const ParallelFor& parallel)>;

// The same of a data set that is read meanwhile, with the same mesh. Coarse scales are used as soon as they are there,
// while the next one is read; what the view does not want is not read (takes_coarse_first(), wants_finer(), on_demand).
// If the data set changes, the stream starts again, and its events and figures with it. parallel: for `next`.
[[nodiscard]] Result<Fetched> fetch_growing(const NextVolume& next, const FetchOptions& options, const FetchEvents& events,
                                            const ParallelFor& parallel = serial);

}  // namespace intervale
