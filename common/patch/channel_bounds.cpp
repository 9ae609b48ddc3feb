#include "common/patch/channel_bounds.h"

#include <algorithm>
#include <cmath>

namespace intervale {

std::array<double, 2> bounds_of(const Channel& channel) {
  const ValueFormat& first = channel.components.front().format;
  if (channel.components.size() == 1) return {first.least(), first.greatest()};
  double longest = 0;
  for (const ChannelComponent& component : channel.components)
    longest = std::hypot(longest, std::max(std::abs(component.format.least()), std::abs(component.format.greatest())));
  return {0, longest};
}

}  // namespace intervale
