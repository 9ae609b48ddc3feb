// Between which numbers the values of a channel are.
#pragma once

#include <array>

#include "common/patch/channel.h"

namespace intervale {

// The least and the greatest value of a scalar; of a vector 0, and a length that none exceeds. channel: as
// check_channels() accepts it.
[[nodiscard]] std::array<double, 2> bounds_of(const Channel& channel);

}  // namespace intervale
