#include "server/serve/stream_plan.h"

#include <algorithm>
#include <bit>
#include <boost/unordered/unordered_flat_map.hpp>
#include <boost/unordered/unordered_flat_set.hpp>

#include "common/refinement.h"

namespace intervale {
namespace {

constexpr std::size_t kBrickBytes = 18;       // naming one takes at most: a step and a mask
constexpr std::size_t kSupercubeBytes = 7;    // a word of slots
constexpr std::size_t kPlaneBytes = 64;       // lengths of all planes
constexpr std::size_t kSmallBatch = 8 << 10;  // a band's end closes a batch no smaller than this
constexpr std::uint32_t kTurn = 1 << 16;      // updates looked at before others get their turn

}  // namespace

// The batch being put together.
struct StreamPlan::Chunk {
  boost::unordered_flat_map<std::uint32_t, SlotGroup> groups;  // by supercube
  boost::unordered_flat_set<std::uint32_t> bricks;
  std::size_t max_bytes = 0, bytes = kPlaneBytes;
  std::uint32_t updates = 0;
  std::uint32_t seen = 0;  // updates looked at
};

StreamPlan::StreamPlan(std::shared_ptr<const IntervalVolume> volume) : volume_(std::move(volume)), sent_(volume_->size()) {
  const auto bricks = volume_->set().bricks();
  waiting_.resize(bricks.size());
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    const UpdateIndex end = b + 1 < bricks.size() ? bricks[b + 1].first : volume_->size();
    waiting_[b].unsent = std::uint16_t(end - bricks[b].first);
  }
}

bool StreamPlan::resume(SupercubeKey key, std::uint64_t slots) {
  const SupercubeSet& set = volume_->set();
  const auto found = set.find_supercube(scale_of_key(key), position_of_key(key));
  if (!found || (slots & ~set.occupancy()[found->supercube]) != 0) return false;
  for (; slots != 0; slots &= slots - 1) {
    const UpdateIndex i = set.place_in(found->brick, found->supercube, key, std::countr_zero(slots)).index;
    if (sent_.contains(i)) continue;
    sent_.insert(i);
    ++sent_count_;
    --waiting_[found->brick].unsent;
  }
  return true;
}

void StreamPlan::set_lod(const Lod& lod) {
  only_.reset();
  if (lod.max_updates) {
    SplitSet wanted = select(*volume_, lod);
    if (wanted.count() > *lod.max_updates) {
      const auto order = in_order(*volume_, wanted, lod);
      for (std::size_t i = *lod.max_updates; i < order.size(); ++i) wanted.erase(order[i]);
    }
    only_ = std::move(wanted);
  }
  ranking_.emplace(*volume_, lod);
  for (std::uint32_t b = 0; b < waiting_.size(); ++b) {
    if (waiting_[b].unsent == 0) continue;
    set_waiting(b, std::max(ranking_->of_brick(b).bound(), only_ ? Rank(1) : Rank(0)), waiting_[b].unsent);
  }
  begin_band();
}

void StreamPlan::set_waiting(std::uint32_t brick, Rank rank, unsigned wanted) {
  Waiting& w = waiting_[brick];
  if (w.unsent == 0) rank = 0;
  wanted = rank == 0 ? 0 : std::min<unsigned>(wanted, w.unsent);
  wanted_count_ += wanted - std::uint64_t(w.wanted);
  waiting_bricks_ += std::uint32_t(rank != 0) - std::uint32_t(w.rank != 0);
  w.rank = rank;
  w.wanted = std::uint16_t(wanted);
}

void StreamPlan::begin_band() {
  next_brick_ = std::uint32_t(waiting_.size());
  Rank top = 0;
  for (const Waiting& w : waiting_) top = std::max(top, w.rank);
  band_ = top == 0 ? Rank(0) : ranking_->band_below(top);
}

StreamPlan::ToGo StreamPlan::to_go() const {
  Rank top = 0;
  for (const Waiting& w : waiting_) top = std::max(top, w.rank);
  ToGo to_go{wanted_count_, 0, 0};
  if (top == 0) return to_go;
  if (!ranking_->has_camera()) {
    to_go.error = ranking_->bound(top);
    return to_go;
  }
  to_go.pixels = ranking_->bound(top);
  unsigned level = 0;
  for (std::uint32_t b = 0; b < waiting_.size(); ++b) {
    if (waiting_[b].rank != 0) level = std::max(level, volume_->brick_error_level(b));
  }
  to_go.error = volume_->error_levels()[level];
  return to_go;
}

// Puts an update into the batch, after the ancestors it lacks. False if the batch is full first; what went in is closed under parents all the same.
bool StreamPlan::take(const Place& place, Chunk& chunk) {
  if (sent_.contains(place.index)) return true;
  const SupercubeSet& set = volume_->set();
  const Diamond d(set.centre(place));
  for (int k = 0; k < d.row->parents; ++k) {
    const Vertex c = d.parent(k);
    if ((c.x | c.y | c.z) < 0) continue;
    const auto parent = set.find(c);
    if (parent && !take(*parent, chunk)) return false;
  }
  const UpdateCode code = volume_->codes()[place.index];
  const auto group = chunk.groups.find(place.supercube);
  std::size_t bytes = 1 + code.coefficients();
  if (group == chunk.groups.end()) bytes += kSupercubeBytes + (chunk.bricks.contains(place.brick) ? 0 : kBrickBytes);
  if (chunk.bytes + bytes > chunk.max_bytes || chunk.updates == kBatchUpdatesMost) return false;
  chunk.bytes += bytes;
  ++chunk.updates;
  if (group == chunk.groups.end()) {
    chunk.bricks.insert(place.brick);
    chunk.groups.emplace(place.supercube, SlotGroup{place.brick, place.supercube, place.key, std::uint64_t(1) << place.slot});
  } else {
    group->second.slots |= std::uint64_t(1) << place.slot;
  }
  sent_.insert(place.index);
  ++sent_count_;
  Waiting& w = waiting_[place.brick];
  --w.unsent;
  if (w.wanted > w.unsent) set_waiting(place.brick, w.rank, w.unsent);
  return true;
}

// Takes what the band wants of a brick. False if the batch is full first.
bool StreamPlan::look_into(std::uint32_t brick, Chunk& chunk) {
  const SupercubeSet& set = volume_->set();
  const Ranking::Brick ranking = ranking_->of_brick(brick);
  Rank most = 0;  // no lower than any of what is left
  unsigned left_wanted = 0;
  bool full = false;
  set.for_each_supercube(brick, [&](std::uint32_t s, SupercubeKey key) {
    if (full) return;
    const UpdateIndex first = set.first(brick, s);
    const std::uint64_t occupancy = set.occupancy()[s];
    const auto count = unsigned(std::popcount(occupancy));
    ++chunk.seen;
    std::uint64_t unsent = ~sent_.some(first, count) & (~std::uint64_t(0) >> (64 - count));
    if (only_) unsent &= only_->some(first, count);
    if (unsent == 0) return;
    const Ranking::Supercube here = ranking.supercube(s, key);
    const Rank bound = only_ ? std::max(here.bound(), Rank(1)) : here.bound();  // only_ has ancestors too: they come last
    if (bound < band_) {
      most = std::max(most, bound);
      left_wanted += bound == 0 ? 0 : unsigned(std::popcount(unsent));
      return;
    }
    chunk.seen += count;
    const float in_band = here.least(band_);
    float most_left = only_ ? here.least(1) : 0;
    bool some_left = false;
    int slot = -1;  // of the update last looked at
    std::uint64_t slots = occupancy;
    unsigned at = 0;  // its number in the supercube, and 1
    for (; unsent != 0 && !full; unsent &= unsent - 1) {
      const auto k = unsigned(std::countr_zero(unsent));
      float importance = here.importance(volume_->error_level(first + k));
      if (importance == 0 && !only_) continue;
      for (; at <= k; ++at, slots &= slots - 1) slot = std::countr_zero(slots);
      if (!here.meets_roi(slot)) importance = 0;
      if (only_) importance = std::max(importance, here.least(1));
      if (importance == 0) continue;
      if (importance >= in_band) {
        full = !take({key, brick, s, std::uint32_t(slot), first + k}, chunk);
      } else {
        most_left = std::max(most_left, importance);
        some_left = true;
        ++left_wanted;
      }
    }
    if (some_left) most = std::max(most, here.rank(most_left));
  });
  if (!full) set_waiting(brick, most, left_wanted);
  return !full;
}

std::optional<Batch> StreamPlan::next(std::size_t max_bytes) {
  Chunk chunk;
  chunk.max_bytes = max_bytes;
  while (!done()) {
    if (next_brick_ == 0) {
      if (chunk.bytes >= kSmallBatch) break;
      begin_band();
    }
    if (waiting_[next_brick_ - 1].rank < band_) {
      --next_brick_;
      continue;
    }
    if (!look_into(next_brick_ - 1, chunk)) break;
    --next_brick_;
    if (chunk.seen >= kTurn) break;
  }
  if (chunk.updates == 0) return {};
  std::vector<SlotGroup> groups;
  groups.reserve(chunk.groups.size());
  for (const auto& [supercube, group] : chunk.groups) groups.push_back(group);
  std::sort(groups.begin(), groups.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.supercube < b.supercube; });
  Batch batch;
  batch.payload = encode_batch(*volume_, sent_, groups);
  batch.updates = chunk.updates;
  return batch;
}

}  // namespace intervale
