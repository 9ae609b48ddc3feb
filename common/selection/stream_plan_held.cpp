// What the client holds without having been sent it, what it gives up, and what is kept while it rests.
#include <algorithm>
#include <bit>

#include "common/selection/stream_plan.h"

namespace intervale {

bool StreamPlan::resume(SupercubeKey key, std::uint64_t slots) {
  const SupercubeSet& set = volume_->set();
  const auto found = set.find_supercube(scale_of_key(key), position_of_key(key));
  if (!found || (slots & ~set.occupancy()[found->supercube]) != 0) return false;
  const std::uint64_t occupancy = set.occupancy()[found->supercube];
  const UpdateIndex first = set.first(found->brick, found->supercube);
  const std::uint64_t added = slots & ~sent_.slots(first, occupancy);
  if (added == 0) return true;
  sent_.insert(first, occupancy, added);
  sent_count_ += std::uint64_t(std::popcount(added));
  count_sent(found->brick, std::popcount(added));
  Pending pending = this->pending(found->brick);
  pending.set_unsent(pending.unsent - unsigned(std::popcount(added & relevant_slots(found->brick, found->supercube))));
  keep(found->brick, pending);
  return true;
}

void StreamPlan::resume(const StreamPlan& other) {
  for (const SlotGroup& g : other.sent_.groups(other.volume_->set())) resume(g.key, g.slots);
}

bool StreamPlan::forget(std::span<const SlotGroup> groups) {
  const SupercubeSet& set = volume_->set();
  for (const SlotGroup& g : groups) {
    const auto found = set.find_supercube(scale_of_key(g.key), position_of_key(g.key));
    if (!found || (g.slots & ~set.occupancy()[found->supercube]) != 0) return false;
  }
  SetNeighbours around(set);
  const auto sent_slots = [this](const SetFinder::Found& found) { return found.occupancy == 0 ? 0 : sent_.slots(found.first, found.occupancy); };
  merge_finest_first(groups, around, sent_slots, [&](const SlotGroup&, Slot slot) {
    const SetFinder::Found& here = around.at(kHere);
    const UpdateIndex i = here.index(slot);
    sent_.erase(i);
    --sent_count_;
    count_sent(here.brick, -1);
    for (SentChannel& channel : channels_) {
      if (channel.count == 0 || !channel.held.contains(i)) continue;
      channel.held.erase(i);
      --channel.count;
    }
    if (relevant_->bound(here.brick).updates == 0) return;
    const InBrick in = in_brick(here.brick, here.supercube);
    const std::uint64_t relevant = in.needs.slots(in.number, here.occupancy);
    if ((relevant >> slot & 1) == 0) return;
    Pending pending = this->pending(here.brick);
    pending.set_unsent(std::min<unsigned>(pending.unsent + 1U, in.needs.updates()));
    const Highest again = of_update(in, i, in.needs.of_supercube(in.number, relevant), slot);
    pending.raise_to(again, object_error(in, again));
    keep(here.brick, pending);
    Bounds bounds = bounds_of(here.brick, in.needs);
    Highest highest = bounds.highest[in.number];
    highest.raise(again);
    bounds.set(in.number, highest);
    keep(here.brick, bounds);
  });
  return true;
}

StreamPlan::Resting StreamPlan::rest() const {
  Resting resting{{{volume_->set(), sent_}, sent_count_}, std::vector<Resting::Held>(channels_.size()), relevant_, shown_};
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].count != 0) resting.channels[i] = {{volume_->set(), channels_[i].held}, channels_[i].count};
  }
  return resting;
}

StreamPlan::StreamPlan(std::shared_ptr<const IntervalVolume> volume, const Resting& resting)
    : volume_(std::move(volume)),
      sent_(resting.sent.updates.unpack(volume_->set())),
      sent_in_(volume_->set().bricks().size()),
      channels_(resting.channels.size()),
      sent_count_(resting.sent.count) {
  const SupercubeSet& set = volume_->set();
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    if (const unsigned sent = sent_.count(set.bricks()[b].first, set.updates(b))) sent_in_.set(b, std::uint16_t(sent));
  }
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (resting.channels[i].count != 0) channels_[i] = {resting.channels[i].updates.unpack(volume_->set()), resting.channels[i].count};
  }
  set_relevant(resting.relevant, resting.shown);
}

std::size_t StreamPlan::Resting::memory_bytes() const {
  std::size_t bytes = sizeof *this + sent.updates.memory_bytes();
  for (const Held& channel : channels) bytes += sizeof channel + channel.updates.memory_bytes();
  return bytes;
}

}  // namespace intervale
