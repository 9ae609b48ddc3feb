// What a client holds of a channel: the keys of its values at the centres of diamonds that its front has split.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "common/codec/channel_batch.h"
#include "common/diamond/domain.h"
#include "common/front/block_index.h"
#include "common/front/front.h"
#include "common/front/slot_array.h"
#include "common/patch/channel.h"
#include "common/util/result.h"

namespace intervale {

class ChannelValues {
 public:
  // channel: one of the data set's, as check_channels() accepts it.
  ChannelValues(const Grid& grid, Channel channel) : channel_(std::move(channel)), domain_(grid.dims) {}

  [[nodiscard]] const Channel& channel() const { return channel_; }
  // The slots of a supercube's diamonds that have a value, and all of them, by supercube, keys ascending.
  [[nodiscard]] std::uint64_t slots(SupercubeKey supercube) const;
  [[nodiscard]] std::vector<SlotGroup> groups() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  // For Front::mesh(): NaN where there is no value. Must outlive the result, and not change meanwhile.
  [[nodiscard]] MeshChannel for_mesh() const;

  // Takes the values at the diamonds of these groups, which have none yet. False if the bytes are damaged; the object
  // must not be used any more then.
  [[nodiscard]] bool take(RangeDecoder& coder, bool is_plain, std::span<const SlotGroup> groups);
  // Forgets the values of those diamonds of these groups that a front has not split.
  void keep_split(const Front& front, std::span<const SlotGroup> groups);

 private:
  struct Block {
    Vertex position;
    std::int32_t scale = 0;
    std::uint64_t slots = 0;
    std::array<SlotKeys, kMaxComponents> keys;  // by component
  };
  class Decoding;
  [[nodiscard]] const Block* find(int scale, Vertex position) const;

  Channel channel_;
  Domain domain_;
  std::deque<Block> blocks_;
  BlockIndex index_;
};

// Takes the channels' part of a batch, `bytes`. updates: the batch's other part, or nothing. front: with those updates.
// channels: those of the batch, in order of their numbers; they get values at all split diamonds of the supercubes that
// the updates name; without updates, at those diamonds that this part names.
[[nodiscard]] Result<void> apply_channels(std::span<ChannelValues* const> channels, const Front& front, std::span<const std::uint8_t> updates,
                                          std::span<const std::uint8_t> bytes);

}  // namespace intervale
