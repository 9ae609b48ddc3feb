// Encodes the values of channels in a batch (common/codec/channel_batch.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/diamond/split_set.h"
#include "common/ivm/interval_volume.h"

namespace intervale {

// A channel of a volume, by number, and the diamonds at which the client has its value once the batch is applied.
struct SentChannel {
  std::size_t number = 0;
  const SplitSet* held = nullptr;
};

// The channels' part of a batch. Appended to `out`. groups: supercubes, keys strictly ascending. to_send: for each
// channel in turn, the slots of each group that the client gets the value of.
void append_channel_values(std::vector<std::uint8_t>& out, const IntervalVolume& volume, std::span<const SentChannel> channels,
                           std::span<const std::vector<SlotGroup>> to_send);

// The most bytes that the values of these channels at one update take there.
[[nodiscard]] std::size_t most_channel_bytes(const IntervalVolume& volume, std::span<const std::size_t> channels);

}  // namespace intervale
