#include "common/patch/channel.h"

#include <algorithm>

#include "common/patch/labels.h"
#include "common/util/printable.h"

namespace intervale {
namespace {

Result<void> check_component(const ChannelComponent& component) {
  if (auto format = check_value_format(component.format); !format) return format;
  if (component.format.table) return fail("a channel's values have a table");
  if (std::any_of(component.corners.begin(), component.corners.end(), [&](ValueKey key) { return key > component.format.last; }))
    return fail("a channel's value at a corner is out of range");
  return {};
}

}  // namespace

bool is_channel_name(std::string_view name) { return !name.empty() && is_label(name) && name != "surface" && name != "value" && name != "range"; }

Result<void> check_channels(std::span<const Channel> channels) {
  if (channels.size() > kMaxChannels) return fail("more than " + std::to_string(kMaxChannels) + " channels");
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const Channel& channel = channels[i];
    if (!is_channel_name(channel.name) || !is_label(channel.unit)) return fail("a channel's name or unit is no label");
    const auto same = [&channel](const Channel& other) { return other.name == channel.name; };
    if (std::any_of(channels.begin(), channels.begin() + std::ptrdiff_t(i), same)) return fail("two channels have one name");
    if (channel.components.size() != 1 && channel.components.size() != kMaxComponents) return fail("a channel is no scalar and no vector");
    for (const ChannelComponent& component : channel.components) {
      if (auto valid = check_component(component); !valid) return valid;
    }
  }
  return {};
}

Result<std::vector<std::size_t>> find_channels(std::span<const Channel> channels, std::span<const std::string> names) {
  std::vector<bool> is_named(channels.size());
  for (const std::string& name : names) {
    const auto found = std::find_if(channels.begin(), channels.end(), [&name](const Channel& channel) { return channel.name == name; });
    if (found == channels.end()) {
      std::string has;
      for (const Channel& channel : channels) has += (has.empty() ? "" : ", ") + channel.name;
      return misuse("the data set has no channel '" + printable(name) + "'; it has " + (has.empty() ? "none" : has));
    }
    is_named[std::size_t(found - channels.begin())] = true;
  }
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (is_named[i]) numbers.push_back(i);
  }
  return numbers;
}

}  // namespace intervale
