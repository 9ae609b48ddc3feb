#include "common/ivm/channel_encoder.h"

#include <algorithm>
#include <bit>

#include "common/codec/channel_batch.h"
#include "common/diamond/supercube_neighbours.h"

namespace intervale {
namespace {

// What code_channel() needs.
class Encoding {
 public:
  Encoding(const IntervalVolume& volume, const SentChannel& channel)
      : keys_(volume.channel_keys()[channel.number]), held_(*channel.held), around_(volume.set()) {}
  void move_to(const SlotGroup& group) { around_.move_to(group.key); }
  bool at_vertex(Link link, ComponentKeys& keys) {
    const auto vertex = around_.at(link);
    if (!vertex.supercube.has(vertex.slot)) return false;
    if ((held_.slots(vertex.supercube.brick, vertex.supercube.key) >> vertex.slot & 1) == 0) return false;
    get(vertex.index(), keys);
    return true;
  }
  void code(Slot slot, ComponentKeys& keys) { get(around_.at(kHere).index(slot), keys); }

 private:
  void get(UpdateIndex i, ComponentKeys& keys) const {
    for (std::size_t c = 0; c < keys_.size(); ++c) keys[c] = keys_[c][i];
  }
  const ChannelKeys& keys_;
  const SplitSet& held_;
  SetNeighbours around_;
};

unsigned bits_of(const Channel& channel) {
  unsigned bits = 0;
  for (const ChannelComponent& component : channel.components) bits += unsigned(std::bit_width(component.format.last));
  return bits;
}

}  // namespace

std::size_t most_channel_bytes(const IntervalVolume& volume, std::span<const std::size_t> channels) {
  std::size_t bytes = 0;
  for (const std::size_t number : channels) bytes += bits_of(volume.description().channels[number]) / 8 + 1;
  return bytes;
}

void append_channel_values(std::vector<std::uint8_t>& out, const IntervalVolume& volume, std::span<const SentChannel> channels,
                           std::span<const std::vector<SlotGroup>> to_send) {
  const auto coded = [&](bool is_plain) {
    RangeEncoder coder;
    coder.raw_bits(1, unsigned(is_plain));
    for (std::size_t i = 0; i < channels.size(); ++i) {
      Encoding encoding(volume, channels[i]);
      (void)code_channel(coder, is_plain, volume.description().channels[channels[i].number], volume.domain(), to_send[i], encoding);
    }
    return coder.finish();
  };
  std::size_t plain_bits = 0;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    for (const SlotGroup& group : to_send[i])
      plain_bits += std::size_t(std::popcount(group.slots)) * bits_of(volume.description().channels[channels[i].number]);
  }
  std::vector<std::uint8_t> bytes = coded(false);
  if (bytes.size() > sizeof(std::uint64_t) + plain_bits / 8) bytes = coded(true);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace intervale
