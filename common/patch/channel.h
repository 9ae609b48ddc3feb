// Channels: other fields on the grid of a data set, scalars and vectors, which its meshes can bring along.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/patch/value_format.h"
#include "common/patch/value_weights.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr std::size_t kMaxChannels = 16;   // of a data set
inline constexpr std::size_t kMaxComponents = 3;  // of a channel

// One number of a channel at each vertex. Coded like the values of the field.
struct ChannelComponent {
  ValueFormat format;                             // without a table
  bool is_exact = true;                           // whether every sample is the value of its key
  std::array<ValueKey, kRootVertices> corners{};  // at the root's vertices, in local order
  ValueWeights weights;                           // of the prediction of values
  friend bool operator==(const ChannelComponent&, const ChannelComponent&) = default;
};

struct Channel {
  std::string name;                          // as is_channel_name() accepts it
  std::string unit;                          // as is_label() accepts it; empty if it is not known
  std::vector<ChannelComponent> components;  // 1, of a scalar; or 3, of a vector
  friend bool operator==(const Channel&, const Channel&) = default;
};

// A label (labels.h) that is not empty and names no other array of a mesh: surface, value, range.
[[nodiscard]] bool is_channel_name(std::string_view name);

// Checks channels from outside: their number, names that differ, labels, 1 or 3 components, formats as
// check_value_format() accepts them, without a table, and the corners' keys in them.
[[nodiscard]] Result<void> check_channels(std::span<const Channel> channels);

// The numbers of the channels with these names, ascending and each once. Misuse, with what there is, if there is none of
// a name.
[[nodiscard]] Result<std::vector<std::size_t>> find_channels(std::span<const Channel> channels, std::span<const std::string> names);

}  // namespace intervale
