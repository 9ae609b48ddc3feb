// A coarser stand-in for a mesh: what a viewer shows while its range or its camera changes from moment to moment.
#pragma once

#include <cstdint>
#include <vector>

#include "client/core/stream_client.h"
#include "common/front/front.h"

namespace intervale {

// The front of a client's splits without those of its finest levels, for the same range. A level is the diamonds of one
// scale and class. levels: at least 0; 3 for each scale. O(the client's splits).
[[nodiscard]] Front coarse_front(const StreamClient& client, int levels);

// The same of what one of the client's fronts shows, for its range: nothing that this front hides.
[[nodiscard]] Front coarse_shown_front(const StreamClient& client, const Front& fine, int levels);

// How many splits coarse_front() has, by the number of levels left out: from none, which leaves all splits, to all.
[[nodiscard]] std::vector<std::uint64_t> counts_without_finest(const StreamClient& client);

}  // namespace intervale
