#include "common/selection/stream_plan.h"

#include <algorithm>
#include <array>
#include <bit>
#include <boost/unordered/unordered_flat_map.hpp>
#include <boost/unordered/unordered_flat_set.hpp>

#include "common/diamond/ancestor_inserter.h"
#include "common/ivm/batch_encoder.h"
#include "common/ivm/channel_encoder.h"

namespace intervale {
namespace {

constexpr std::uint32_t kFindVisits = 1 << 12;  // finding what a brick needs takes as long as so many visits
constexpr std::uint32_t kBrickVisits = 128;     // and looking at a brick's bounds, as so many
constexpr std::uint32_t kInVain = 3;            // times as many visits as a batch may have, if they find nothing
constexpr std::size_t kUnsettled = 128;         // supercubes that a batch may leave as they are in what was sent

}  // namespace

// The batch under construction.
struct StreamPlan::BatchBuilder {
  AncestorInserter inserter;
  SetNeighbours around;              // of the supercube visited
  std::vector<SetNeighbours> above;  // of ancestors, by scale; empty until the batch is nearly full
  std::vector<SlotGroup> groups;
  boost::unordered_flat_map<SupercubeIndex, std::uint32_t> group_of;  // by supercube
  boost::unordered_flat_set<BrickIndex> bricks;
  std::size_t update_bytes = 0, max_bytes = 0, bytes = kPlaneBytes;
  std::uint32_t updates = 0;
  std::uint32_t visited = 0;  // supercubes and updates

  BatchBuilder(const IntervalVolume& volume, SplitSet& sent, std::span<const std::size_t> channels, std::size_t max_payload)
      : inserter(volume.set(), sent),
        around(volume.set()),
        update_bytes(1 + volume.keys().width() + most_channel_bytes(volume, channels)),
        max_bytes(max_payload) {}
  // How much longer `count` updates of a supercube make the payload; and the most that it can be.
  [[nodiscard]] std::size_t bytes_of(const SlotGroup& added, std::size_t count) const {
    if (group_of.contains(added.supercube)) return count * update_bytes;
    return count * update_bytes + kSupercubeBytes + (bricks.contains(added.brick) ? 0 : kBrickBytes);
  }
  [[nodiscard]] std::size_t most_bytes_of(std::size_t count) const { return count * update_bytes + kSupercubeBytes + kBrickBytes; }
  void put(const SlotGroup& added, std::uint32_t count) {
    updates += count;
    bytes += count * update_bytes;
    const auto [group, is_new] = group_of.emplace(added.supercube, std::uint32_t(groups.size()));
    if (!is_new) {
      groups[group->second].slots |= added.slots;
      return;
    }
    groups.push_back(added);
    bytes += kSupercubeBytes + (bricks.insert(added.brick).second ? kBrickBytes : 0);
  }
};

StreamPlan::StreamPlan(std::shared_ptr<const IntervalVolume> volume)
    : volume_(std::move(volume)), sent_(volume_->set()), channels_(volume_->channel_keys().size()) {
  set_relevant(std::shared_ptr<const RelevantUpdates>(volume_, &volume_->relevant()));
}

void StreamPlan::set_relevant(std::shared_ptr<const RelevantUpdates> relevant, ShownRanges shown) {
  search_.reset();
  searched_.reset();
  rests_ = false;
  const std::shared_ptr<const RelevantUpdates> before = std::exchange(relevant_, std::move(relevant));
  shown_ = std::move(shown);
  const RelevantUpdates::PartMask new_parts = find_new_parts(before.get());
  const SupercubeSet& set = volume_->set();
  viewed_ = decltype(viewed_)(set.bricks().size());
  viewed_runs_.clear();
  wanted_count_ = pending_bricks_ = 0;
  for (std::size_t begin = 0; begin < viewed_.size(); begin += 64) {
    for (const std::size_t k : set_bits<std::size_t>(sent_.bricks(begin) | pending_.used(begin))) {
      const BrickIndex b{std::uint32_t(begin + k)};
      const unsigned sent = sent_.count(b);
      const auto found = pending_.find(b);
      const RelevantUpdates::Bound all = relevant_->bound(b);
      Pending pending = found ? bits_as<Pending>(*found) : first_pending(all);
      unsigned unsent = all.updates;
      if (found) {
        const RelevantUpdates::Bound added = relevant_->bound(b, new_parts);
        pending.raise_to({added.error_step, 0, added.slope, 0}, added.object_error);
        unsent = std::min(unsent, unsigned(pending.unsent) + added.updates);
      }
      pending.set_unsent(std::min(unsent, set.updates(b) - sent));
      keep(b, pending);
    }
  }
}

// Which parts of what is relevant were not relevant before: bounds that are known of unsent updates need to be raised
// to those of these parts only, since what is not relevant any more leaves them as they are. before: may be null. If
// none of these bounds can be kept, all of them are dropped, and time begins again.
RelevantUpdates::PartMask StreamPlan::find_new_parts(const RelevantUpdates* before) {
  const auto shared = before != nullptr && time_ < UINT8_MAX ? relevant_->shared_with(*before) : std::nullopt;
  if (!shared) {
    drop_bounds();
    return RelevantUpdates::kAllParts;
  }
  ++time_;
  RelevantUpdates::PartMask added = 0;
  const auto since = part_since_;
  for (std::size_t i = 0; i < shared->size(); ++i) {
    const bool is_new = (*shared)[i] < 0;
    added |= RelevantUpdates::PartMask(unsigned(is_new) << i);
    part_since_[i] = is_new ? time_ : since[std::size_t((*shared)[i])];
  }
  return added;
}

void StreamPlan::drop_bounds() {
  time_ = 0;
  part_since_ = {};
  pending_ = SparseArray<std::uint64_t>(volume_->set().bricks().size());
  supercube_bounds_ = SupercubeBounds(volume_->set().bricks().size());
}

void StreamPlan::rest() {
  drop_bounds();
  viewed_.release_all();
  viewed_runs_ = std::vector<ViewedRun>();
  ranking_.reset();
  searched_.reset();
  budget_.reset();
  wanted_count_ = pending_bricks_ = next_brick_ = 0;
  rests_ = true;
}

void StreamPlan::set_lod(const Lod& lod, const DepthMap* hidden, const Camera* ahead) {
  if (rests_) set_relevant(relevant_, shown_);
  if (searched_ != lod) {
    searched_ = lod;
    budget_.reset();
    search_ = lod.max_updates ? std::make_shared<BudgetSearch>(volume_, relevant_, lod) : nullptr;
  }
  ranking_.emplace(*volume_, *relevant_, lod, hidden, ahead);
  rank_runs();
}

// Adds an update after its missing ancestors. around: of its supercube; those of the ancestors are cached in the
// builder, since the next update is near by. False if the batch is full first; even then the batch is closed under
// parents.
bool StreamPlan::add_with_ancestors(const Place& place, SetNeighbours& around, BatchBuilder& builder) {
  const Links& links = around.links(place.slot);
  const int parents = diamond_type(kTypeOfSlot[place.slot]).parents;
  for (int k = 0; k < parents; ++k) {
    const Link link = links.vertex[links.parent[k]];
    around.move_to(place.key);  // an ancestor of the same scale may have moved it
    const SetFinder::Found& found = around.at(link.where);
    if (!found.has(link.slot)) continue;
    const Place parent = found.place(link.slot);
    if (sent_.contains(parent)) continue;
    SetNeighbours& above = builder.above[std::size_t(scale_of_key(parent.key))];
    above.move_to(parent.key);
    if (!add_with_ancestors(parent, above, builder)) return false;
  }
  return sent_.contains(place) || add(place, builder);
}

bool StreamPlan::add(const Place& place, BatchBuilder& builder) {
  const SlotGroup update{place.brick, place.supercube, place.key, std::uint64_t(1) << place.slot};
  if (builder.bytes + builder.bytes_of(update, 1) > builder.max_bytes || !has_room(builder, 1)) return false;
  sent_.insert(place);
  put(update, builder);
  return true;
}

// Adds unsent updates of a supercube and their missing ancestors at once. Adds nothing and returns false if the batch
// may be full first.
bool StreamPlan::add_all(const SlotGroup& group, BatchBuilder& builder) {
  const auto inserted = builder.inserter.insert(group);
  std::size_t bytes = 0, updates = 0;
  for (const SlotGroup& g : inserted) {
    const auto count = std::size_t(std::popcount(g.slots));
    updates += count;
    bytes += builder.most_bytes_of(count);
  }
  if (builder.bytes + bytes > builder.max_bytes || !has_room(builder, updates)) {
    builder.inserter.take_back();
    return false;
  }
  for (const SlotGroup& g : inserted) put(g, builder);
  return true;
}

// Adds updates that are in sent_ by now.
void StreamPlan::put(const SlotGroup& updates, BatchBuilder& builder) {
  const auto count = unsigned(std::popcount(updates.slots));
  builder.put(updates, count);
  sent_count_ += count;
  if (!relevant_->is_found(updates.brick)) return;  // bounds stay as they are: these are ancestors
  Pending w = pending(updates.brick);
  w.set_unsent(w.unsent - unsigned(std::popcount(updates.slots & relevant_slots(updates.brick, updates.supercube))));
  const Viewed viewed = viewed_[updates.brick];
  if (viewed.wanted > w.unsent)
    set_pending(updates.brick, w, viewed.rank, w.unsent);
  else
    keep(updates.brick, w);
}

bool StreamPlan::has_room(const BatchBuilder& builder, std::size_t updates) const {
  return builder.updates + updates <= kBatchUpdatesMost && sent_count_ + updates <= room_;
}

// Adds the updates of a brick that belong to the band. False if the batch is full first.
bool StreamPlan::visit_brick(BrickIndex brick, BatchBuilder& builder) {
  const SupercubeSet& set = volume_->set();
  const Ranking::Brick ranking = ranking_->of_brick(brick);
  if (viewed_[brick].is_loose != 0) refine(brick, ranking);
  if (viewed_[brick].rank < band_) return true;
  if (!relevant_->is_found(brick)) builder.visited += kFindVisits;
  InBrick in{relevant_->brick(brick), 0, scale_of_key(set.bricks()[brick].key), 0};
  Bounds bounds = bounds_of(brick, in.needs);
  Pending before = pending(brick);
  if (ranking_->has_camera()) {
    move_limit(ranking, before, bounds);
    keep(brick, before);
  }
  in.limit = relevant_->distance(before.limit);
  const Rank least = budget_ ? Rank(1) : Rank(0);  // ancestors in the budget come last
  Unsent rest;
  float object_error = 0;
  bool full = false;
  std::size_t count = 0;
  builder.visited += kBrickVisits;
  set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
    if (full) return;
    in.number = count++;
    const std::uint64_t occupancy = set.occupancy()[s], relevant = in.needs.slots(in.number, occupancy);
    if (relevant == 0) {
      bounds.drop(in.number);
      return;
    }
    const Highest all = bounds.highest[in.number];
    const float farthest = this->object_error(in, all);
    const Rank bound = std::max(ranking.bound({all.error_step, farthest, all.slope}), least);
    if (bound < band_ && ranking_->has_camera()) {  // most of them: what was sent is not even looked up
      rest.raise({bound, bound == 0 ? 0 : unsigned(std::popcount(relevant)), all});
      object_error = std::max(object_error, farthest);
      return;
    }
    builder.visited += 4;
    const std::uint64_t unsent = relevant & ~sent_.slots(brick, key);
    if (unsent == 0) return;
    const auto here = visit_supercube(ranking, in, {key, brick, s, {}, set.first(brick, s)}, unsent, all, builder);
    full = !here;
    if (full) return;
    bounds.set(in.number, here->highest);
    rest.raise(*here);
    object_error = std::max(object_error, this->object_error(in, here->highest));
  });
  keep(brick, bounds);
  if (full) return false;
  // What was not looked up may have been sent; but bounds do not grow.
  Pending after = pending(brick);
  after.set_unsent(std::min<unsigned>(after.unsent, in.needs.updates()));
  after.lower_to(rest.highest, object_error);
  set_pending(brick, after, rest.rank, std::min<unsigned>(viewed_[brick].wanted, rest.wanted));
  if (ranking_->has_camera() && viewed_[brick].rank != 0) viewed_.use(brick).pixels = Up16(ranking.pixels(float(after.object_error)));
  return true;
}

// Lowers bounds of a supercube's unsent updates to how far those can move.
void StreamPlan::lower(const InBrick& in, std::uint64_t occupancy, std::uint64_t unsent, Highest& highest) const {
  if (!relevant_->has_distances()) return;
  highest.distance = std::min(highest.distance, in.needs.farthest(in.number, in.needs.slots(in.number, occupancy), unsent));
  if (relevant_->distance(highest.distance) > in.limit) return;
  highest.slope_below = std::max(highest.slope, highest.slope_below);
  highest.slope = 0;
}

// Adds the updates of a supercube that belong to the band, if it may have any. first: its first update. unsent: slots.
// highest: of those. nullopt if the batch is full first.
std::optional<StreamPlan::Unsent> StreamPlan::visit_supercube(const Ranking::Brick& brick, const InBrick& in, const Place& first,
                                                              std::uint64_t unsent, const Highest& highest, BatchBuilder& builder) {
  const SupercubeIndex s = first.supercube;
  const std::uint64_t occupancy = volume_->set().occupancy()[s];
  const auto count = unsigned(std::popcount(occupancy));
  const std::uint64_t candidates = budget_ ? unsent & budget_->slots(first.brick, first.key) : unsent;
  Unsent rest{.highest = highest};
  if (candidates == 0) return rest;
  Ranking::Supercube ranking = brick.rough(in.needs, s, first.key);
  if (ranking_->has_camera()) lower(in, occupancy, unsent, rest.highest);
  const Rank least = budget_ ? Rank(1) : Rank(0);
  const auto bound = [&] { return std::max(ranking.bound(rest.highest.error_step, rest.highest.distance, rest.highest.slope), least); };
  rest.rank = bound();
  if (rest.rank >= band_) {
    ranking.refine();
    rest.rank = bound();
  }
  if (rest.rank < band_) {
    rest.wanted = rest.rank == 0 ? 0 : unsigned(std::popcount(candidates));
    return rest;
  }
  builder.visited += count;
  rest = {};
  if (!add_band(ranking, in, first, candidates, builder, rest)) return {};
  const std::uint64_t others = unsent & ~candidates;
  if (others == 0) return rest;
  const auto known = in.needs.of_supercube(in.number, in.needs.slots(in.number, occupancy));
  auto number = set_bits(extract_bits(others, occupancy)).begin();
  for (const Slot slot : set_bits<Slot>(others)) {
    rest.highest.raise(of_update(in, first.index + *number, known, slot));
    ++number;
  }
  return rest;
}

// Adds the candidates that belong to the band, and bounds the others in `rest`. False if the batch is full first.
bool StreamPlan::add_band(const Ranking::Supercube& ranking, const InBrick& in, const Place& place, std::uint64_t candidates, BatchBuilder& builder,
                          Unsent& rest) {
  const float in_band = ranking.least(band_), least = budget_ ? ranking.least(1) : 0;
  const UpdateIndex first = place.index;
  const std::uint64_t occupancy = volume_->set().occupancy()[place.supercube];
  const auto known = in.needs.of_supercube(in.number, in.needs.slots(in.number, occupancy));
  SlotGroup in_it{place.brick, place.supercube, place.key, 0};
  Highest highest;  // in registers, like all that this loop changes
  unsigned wanted = 0;
  float greatest = 0;
  auto number = set_bits(extract_bits(candidates, occupancy)).begin();
  // Without branches on what is in the band: that is hard to foresee.
  for (const Slot slot : set_bits<Slot>(candidates)) {
    const Highest own = of_update(in, first + *number, known, slot);
    ++number;
    float importance = ranking.importance(own.error_step, own.distance, std::max(own.slope, own.slope_below));
    if (importance > 0 && !ranking.meets_roi(slot)) importance = 0;
    importance = std::max(importance, least);
    const bool is_in_it = importance > 0 && importance >= in_band;
    in_it.slots |= std::uint64_t(is_in_it) << slot;
    highest.raise(is_in_it ? Highest{} : own);
    wanted += unsigned(importance > 0) & unsigned(!is_in_it);
    greatest = std::max(greatest, is_in_it ? 0 : importance);
  }
  rest.highest = highest;
  rest.wanted = wanted;
  rest.rank = ranking.rank(greatest);
  if (in_it.slots == 0 || add_all(in_it, builder)) return true;
  while (builder.above.size() < std::size_t(kMaxLevels)) builder.above.emplace_back(volume_->set());
  builder.around.move_to(place.key);  // the batch is nearly full: one at a time
  for (const Slot slot : set_bits<Slot>(in_it.slots)) {
    if (!add_with_ancestors({place.key, place.brick, place.supercube, slot, first + count_below(occupancy, slot)}, builder.around, builder))
      return false;
  }
  return true;
}

std::optional<Batch> StreamPlan::next(std::size_t max_bytes, std::uint32_t max_visits) {
  if (lacks_values()) return next_values(max_bytes);
  if (search_) {
    if (search_->go_on()) return {};
    budget_ = std::move(*search_).result();
    search_.reset();
    rank_runs();
  }
  BatchBuilder builder(*volume_, sent_, wanted_channels_, max_bytes);
  while (has_more()) {
    if (next_brick_ == 0) {
      if (builder.bytes >= max_bytes / 4 * 3) break;  // little room for another band: it would pay for its names twice
      begin_band();
    }
    const std::size_t run = viewed_.page_of(next_brick_ - 1);
    if (viewed_runs_[run].rank >= band_ && viewed_runs_[run].rank != 0) rank_bricks(run);
    if (!viewed_.is_used(run)) {
      next_brick_ = std::uint32_t(viewed_.begin_of(run));
      continue;
    }
    if (viewed_[next_brick_ - 1].rank < band_) {
      --next_brick_;
      continue;
    }
    const std::uint32_t visited = builder.visited, updates = builder.updates;
    const bool is_full = !visit_brick(BrickIndex(next_brick_ - 1), builder);
    band_visits_ += builder.visited - visited;
    band_updates_ += builder.updates - updates;
    if (is_full) break;
    --next_brick_;
    if (builder.visited >= (builder.updates == 0 ? kInVain * std::uint64_t(max_visits) : max_visits)) break;
  }
  if (builder.updates == 0) {
    sent_.settle(done() ? 0 : kUnsettled);
    return {};
  }
  std::vector<SlotGroup>& groups = builder.groups;
  std::sort(groups.begin(), groups.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.supercube < b.supercube; });
  Batch batch{encode_batch(*volume_, shown_, sent_, groups), builder.updates, {}};
  sent_.settle(done() ? 0 : kUnsettled);
  if (!wanted_channels_.empty()) batch.channels = send_values(groups, {});
  return batch;
}

Batch StreamPlan::no_updates() const { return {encode_batch(*volume_, shown_, sent_, {}), 0, {}}; }

}  // namespace intervale
