// What the client holds without having been sent it, and what it gives up.
#include <algorithm>
#include <bit>

#include "common/selection/stream_plan.h"

namespace intervale {

bool StreamPlan::has(const SlotGroup& updates) const {
  const SupercubeSet& set = volume_->set();
  const auto found = set.find_supercube(scale_of_key(updates.key), position_of_key(updates.key));
  return found && (updates.slots & ~set.occupancy()[found->supercube]) == 0;
}

bool StreamPlan::resume(SupercubeKey key, std::uint64_t slots) {
  const SupercubeSet& set = volume_->set();
  const auto found = set.find_supercube(scale_of_key(key), position_of_key(key));
  if (!found || (slots & ~set.occupancy()[found->supercube]) != 0) return false;
  const std::uint64_t added = slots & ~sent_.slots(found->brick, found->key);
  if (added == 0) return true;
  sent_.insert(found->brick, found->key, added);
  sent_count_ += std::uint64_t(std::popcount(added));
  Pending pending = this->pending(found->brick);
  pending.set_unsent(pending.unsent - unsigned(std::popcount(added & relevant_slots(found->brick, found->supercube))));
  keep(found->brick, pending);
  return true;
}

void StreamPlan::resume(const StreamPlan& other) {
  for (const SlotGroup& g : other.sent_.groups(other.volume_->set())) resume(g.key, g.slots);
  settle();
}

bool StreamPlan::forget(std::span<const SlotGroup> groups) {
  if (groups.empty()) return true;
  if (!std::all_of(groups.begin(), groups.end(), [this](const SlotGroup& g) { return has(g); })) return false;
  const SupercubeSet& set = volume_->set();
  SetNeighbours around(set);
  const auto sent_slots = [this](const SetFinder::Found& found) { return found.occupancy == 0 ? 0 : sent_.slots(found.brick, found.key); };
  merge_finest_first(groups, around, sent_slots, [&](const SlotGroup&, Slot slot) {
    const SetFinder::Found& here = around.at(kHere);
    const Place place = here.place(slot);
    sent_.erase(place);
    --sent_count_;
    for (SentChannel& channel : channels_) {
      if (channel.count == 0 || !channel.held.contains(place)) continue;
      channel.held.erase(place);
      --channel.count;
    }
    if (relevant_->bound(here.brick).updates == 0) return;
    const InBrick in = in_brick(here.brick, here.supercube);
    const std::uint64_t relevant = in.needs.slots(in.number, here.occupancy);
    if ((relevant >> slot & 1) == 0) return;
    Pending pending = this->pending(here.brick);
    pending.set_unsent(std::min<unsigned>(pending.unsent + 1U, in.needs.updates()));
    const Highest again = of_update(in, place.index, in.needs.of_supercube(in.number, relevant), slot);
    pending.raise_to(again, object_error(in, again));
    keep(here.brick, pending);
    Bounds bounds = bounds_of(here.brick, in.needs);
    Highest highest = bounds.highest[in.number];
    highest.raise(again);
    bounds.set(in.number, highest);
    keep(here.brick, bounds);
  });
  settle();
  return true;
}

void StreamPlan::settle() {
  sent_.settle();
  for (SentChannel& channel : channels_) channel.held.settle();
}

}  // namespace intervale
