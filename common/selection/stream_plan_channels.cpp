// The values of channels in a plan: with the updates, and after them where a client switches a channel on.
#include <algorithm>
#include <bit>

#include "common/codec/byte_planes.h"
#include "common/codec/split_names.h"
#include "common/ivm/channel_encoder.h"
#include "common/selection/stream_plan.h"

namespace intervale {
namespace {

constexpr std::uint32_t kMaxSearched = 1 << 16;  // supercubes in one call of next_values(), which ends its batch

}  // namespace

bool StreamPlan::resume(std::size_t channel, SupercubeKey key, std::uint64_t slots) {
  const SupercubeSet& set = volume_->set();
  const auto found = set.find_supercube(scale_of_key(key), position_of_key(key));
  if (!found) return false;
  if ((slots & ~sent_.slots(found->brick, found->key)) != 0) return false;
  SentChannel& sent = channels_[channel];
  if (sent.count == 0) sent.held = SplitSet(set);
  sent.count += std::uint64_t(std::popcount(slots & ~sent.held.slots(found->brick, found->key)));
  sent.held.insert(found->brick, found->key, slots);
  return true;
}

void StreamPlan::set_channels(std::span<const std::size_t> numbers) {
  wanted_channels_.assign(numbers.begin(), numbers.end());
  for (const std::size_t number : numbers) {
    if (channels_[number].count == 0) channels_[number].held = SplitSet(volume_->set());
  }
  next_lacking_ = 0;
}

bool StreamPlan::lacks_values() const {
  return std::any_of(wanted_channels_.begin(), wanted_channels_.end(), [this](std::size_t number) { return channels_[number].count != sent_count_; });
}

// Gives the values that the client lacks at these updates, which it has. Keys ascend. names: what comes first.
std::vector<std::uint8_t> StreamPlan::send_values(std::span<const SlotGroup> groups, std::vector<std::uint8_t> names) {
  std::vector<intervale::SentChannel> sent;
  std::vector<std::vector<SlotGroup>> to_send;
  for (const std::size_t number : wanted_channels_) {
    SentChannel& channel = channels_[number];
    std::vector<SlotGroup>& lacking = to_send.emplace_back(groups.begin(), groups.end());
    for (SlotGroup& g : lacking) {
      g.slots &= ~channel.held.slots(g.brick, g.key);
      channel.held.insert(g.brick, g.key, g.slots);
      channel.count += std::uint64_t(std::popcount(g.slots));
    }
    channel.held.settle();
    sent.push_back({number, &channel.held});
  }
  append_channel_values(names, *volume_, sent, to_send);
  return names;
}

// A batch of values for what was sent without them, from coarse to fine. Nothing: the next call goes on.
std::optional<Batch> StreamPlan::next_values(std::size_t max_bytes) {
  const SupercubeSet& set = volume_->set();
  const std::size_t update_bytes = most_channel_bytes(*volume_, wanted_channels_);
  std::vector<SlotGroup> groups;
  std::size_t bytes = kPlaneBytes;
  bool is_full = false;
  std::uint32_t visited = 0;
  for (; next_lacking_ < viewed_.size() && !is_full && visited < kMaxSearched; next_lacking_ += std::uint32_t(!is_full)) {
    const BrickIndex brick(next_lacking_);
    visited += std::uint32_t(std::popcount(set.bricks()[brick].mask));
    const std::size_t before = groups.size();
    bytes += kBrickBytes;
    set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      const std::uint64_t sent = sent_.slots(brick, key);
      SlotGroup lacking{brick, s, key, 0};
      for (const std::size_t number : wanted_channels_) lacking.slots |= sent & ~channels_[number].held.slots(brick, key);
      if (lacking.slots == 0 || is_full) return;
      const std::size_t left = max_bytes - std::min(max_bytes, bytes + kSupercubeBytes);
      while (std::size_t(std::popcount(lacking.slots)) * update_bytes > left) {
        lacking.slots &= ~(std::uint64_t(1) << (63 - std::countl_zero(lacking.slots)));
        is_full = true;
      }
      bytes += kSupercubeBytes + std::size_t(std::popcount(lacking.slots)) * update_bytes;
      if (lacking.slots != 0) groups.push_back(lacking);
    });
    if (groups.size() == before) bytes -= kBrickBytes;
  }
  if (groups.empty()) return {};
  const std::vector<std::uint8_t> splits = encode_splits(groups);
  std::vector<std::uint8_t> names;
  append_varint(names, splits.size());
  names.insert(names.end(), splits.begin(), splits.end());
  return Batch{{}, 0, send_values(groups, std::move(names))};
}

std::size_t StreamPlan::memory_bytes() const {
  std::size_t bytes = sizeof *this + sent_.memory_bytes() + (budget_ ? budget_->memory_bytes() : 0);
  bytes += viewed_.memory_bytes() + viewed_runs_.capacity() * sizeof(ViewedRun) + pending_.memory_bytes() + supercube_bounds_.memory_bytes();
  if (ranking_) bytes += ranking_->memory_bytes();
  for (const SentChannel& channel : channels_) bytes += sizeof channel + channel.held.memory_bytes();
  return bytes;
}

}  // namespace intervale
