#include "common/front/channel_values.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/codec/byte_planes.h"
#include "common/codec/split_names.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

tl::unexpected<Error> damaged() { return fail("a batch is damaged: its channels"); }

std::uint64_t split_slots(const Front& front, SupercubeKey key) {
  const FrontState::Block* const block = front.state().find_block(scale_of_key(key), position_of_key(key));
  return block == nullptr ? 0 : block->split;
}

// The names at the front of a channels' part without updates.
Result<std::vector<SlotGroup>> take_names(std::span<const std::uint8_t>& bytes) {
  const auto length = take_varint(bytes);
  if (!length || *length > bytes.size()) return damaged();
  auto names = decode_splits(bytes.first(*length), kBatchUpdatesMost);
  bytes = bytes.subspan(*length);
  return names;
}

// All that is split of the supercubes that a batch of updates names.
Result<std::vector<SlotGroup>> names_of(std::span<const std::uint8_t> updates, const Front& front) {
  RangeDecoder coder(updates);
  const bool is_plain = coder.raw_bits(1) != 0;
  const auto keys = decode_supercubes(coder, is_plain, kBatchUpdatesMost);
  if (!keys) return tl::unexpected(keys.error());
  std::vector<SlotGroup> names;
  names.reserve(keys->size());
  for (const SupercubeKey key : *keys) names.push_back({{}, {}, key, split_slots(front, key)});
  return names;
}

}  // namespace

// What code_channel() needs.
class ChannelValues::Decoding {
 public:
  explicit Decoding(ChannelValues& values) : values_(values) {}
  void move_to(const SlotGroup& group) {
    key_ = group.key;
    found_.fill(nullptr);
    is_known_ = {};
  }
  bool at_vertex(Link link, ComponentKeys& keys) {
    const auto where = std::size_t(link.where);
    if ((is_known_[where / 64] >> (where % 64) & 1) == 0) look_up(where);
    const Block* const block = found_[where];
    const Slot slot(link.slot | corner_slot_[where]);
    if (block == nullptr || (block->slots >> slot & 1) == 0) return false;
    for (std::size_t c = 0; c < values_.channel_.components.size(); ++c) keys[c] = block->keys[c][slot];
    return true;
  }
  void code(Slot slot, const ComponentKeys& keys) {
    const int scale = scale_of_key(key_);
    const Vertex position = position_of_key(key_);
    std::uint32_t& number = values_.index_.obtain(scale, position);
    if (number == BlockIndex::kNone) {
      number = std::uint32_t(values_.blocks_.size());
      values_.blocks_.push_back({position, scale, 0, {}});
    }
    Block& block = values_.blocks_[number];
    block.slots |= std::uint64_t(1) << slot;
    for (std::size_t c = 0; c < values_.channel_.components.size(); ++c) block.keys[c].set(slot, keys[c], values_.channel_.components[c].format.last);
    found_[kHere] = &block;
    is_known_[0] |= std::uint64_t(1) << kHere;
  }

 private:
  void look_up(std::size_t where) {
    const SupercubePlace place = neighbour_at(int(where), scale_of_key(key_), position_of_key(key_));
    corner_slot_[where] = place.slot;
    found_[where] = place.exists() ? values_.find(place.scale, place.position) : nullptr;
    is_known_[where / 64] |= std::uint64_t(1) << (where % 64);
  }

  ChannelValues& values_;
  SupercubeKey key_ = 0;
  std::array<const Block*, kNeighbours> found_{};  // a block stays where it is
  std::array<Slot, kNeighbours> corner_slot_{};
  std::array<std::uint64_t, 2> is_known_{};
};

const ChannelValues::Block* ChannelValues::find(int scale, Vertex position) const {
  const std::uint32_t number = index_.find(scale, position);
  return number == BlockIndex::kNone ? nullptr : &blocks_[number];
}

std::uint64_t ChannelValues::slots(SupercubeKey supercube) const {
  const Block* const block = find(scale_of_key(supercube), position_of_key(supercube));
  return block == nullptr ? 0 : block->slots;
}

std::vector<SlotGroup> ChannelValues::groups() const {
  std::vector<SlotGroup> groups;
  for (const Block& block : blocks_) {
    if (block.slots != 0) groups.push_back({{}, {}, supercube_key(block.scale, block.position), block.slots});
  }
  std::sort(groups.begin(), groups.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.key < b.key; });
  return groups;
}

std::size_t ChannelValues::memory_bytes() const {
  std::size_t bytes = index_.memory_bytes() + blocks_.size() * sizeof(Block);
  for (const Block& block : blocks_) {
    for (const SlotKeys& keys : block.keys) bytes += keys.memory_bytes();
  }
  return bytes;
}

MeshChannel ChannelValues::for_mesh() const {
  const auto values_at = [this](Vertex vertex, std::span<double> values) {
    const int corner = domain_.corner_number(vertex);
    const int scale = corner < 0 ? scale_of(vertex) : 0;
    const Block* const block = corner < 0 ? find(scale, {vertex.x >> (scale + 2), vertex.y >> (scale + 2), vertex.z >> (scale + 2)}) : nullptr;
    const Slot slot = corner < 0 ? kSlotOfType[Diamond(vertex).type] : Slot();
    const bool is_known = corner >= 0 || (block != nullptr && (block->slots >> slot & 1) != 0);
    for (std::size_t c = 0; c < values.size(); ++c) {
      const ChannelComponent& component = channel_.components[c];
      const ValueKey key = !is_known ? 0 : corner >= 0 ? component.corners[std::size_t(corner)] : block->keys[c][slot];
      values[c] = is_known ? component.format.value(key) : std::numeric_limits<double>::quiet_NaN();
    }
  };
  return {channel_.name, channel_.unit, unsigned(channel_.components.size()), values_at};
}

bool ChannelValues::take(RangeDecoder& coder, bool is_plain, std::span<const SlotGroup> groups) {
  Decoding decoding(*this);
  return code_channel(coder, is_plain, channel_, domain_, groups, decoding);
}

void ChannelValues::keep_split(const Front& front, std::span<const SlotGroup> groups) {
  for (const SlotGroup& group : groups) {
    const std::uint32_t number = index_.find(scale_of_key(group.key), position_of_key(group.key));
    if (number != BlockIndex::kNone) blocks_[number].slots &= split_slots(front, group.key);
  }
}

Result<void> apply_channels(std::span<ChannelValues* const> channels, const Front& front, std::span<const std::uint8_t> updates,
                            std::span<const std::uint8_t> bytes) {
  const auto named = updates.empty() ? take_names(bytes) : names_of(updates, front);
  if (!named) return damaged();
  std::vector<SlotGroup> groups;
  RangeDecoder coder(bytes);
  const bool is_plain = coder.raw_bits(1) != 0;
  for (ChannelValues* const channel : channels) {
    groups = *named;
    for (SlotGroup& group : groups) group.slots &= split_slots(front, group.key) & ~channel->slots(group.key);
    if (!channel->take(coder, is_plain, groups)) return damaged();
  }
  if (!coder.is_spent()) return damaged();
  return {};
}

}  // namespace intervale
