#include "server/serve/stream_plan.h"

#include <algorithm>
#include <bit>
#include <boost/unordered/unordered_flat_map.hpp>
#include <boost/unordered/unordered_flat_set.hpp>

namespace intervale {
namespace {

constexpr std::uint64_t kFirstBand = 2048;    // updates: a first mesh in a few KiB
constexpr std::size_t kBrickBytes = 18;       // naming one takes at most: a step and a mask
constexpr std::size_t kSupercubeBytes = 7;    // a word of slots
constexpr std::size_t kPlaneBytes = 64;       // lengths of all planes
constexpr std::size_t kSmallBatch = 8 << 10;  // a band's end closes a batch no smaller than this

}  // namespace

// The batch being put together.
struct StreamPlan::Chunk {
  boost::unordered_flat_map<std::uint32_t, SlotGroup> groups;  // by supercube
  boost::unordered_flat_set<std::uint32_t> bricks;
  std::size_t max_bytes = 0, bytes = kPlaneBytes;
  std::uint32_t updates = 0;
};

StreamPlan::StreamPlan(std::shared_ptr<const IntervalVolume> volume) : volume_(std::move(volume)), sent_(volume_->size()), wanted_(volume_->size()) {}

void StreamPlan::set_lod(const Lod& lod) {
  wanted_ = select(*volume_, lod);
  if (lod.max_updates && wanted_.count() > *lod.max_updates) {
    const auto order = in_order(*volume_, wanted_);
    for (std::size_t i = *lod.max_updates; i < order.size(); ++i) wanted_.erase(order[i]);
  }
  wanted_count_ = wanted_.count();
  waiting_.fill(0);
  waiting_count_ = 0;
  for (UpdateIndex i = 0; i < volume_->size(); ++i) {
    if (!wanted_.contains(i) || sent_.contains(i)) continue;
    ++waiting_[volume_->error_level(i)];
    ++waiting_count_;
  }
  next_supercube_ = 0;
  band_ = kErrorLevels;
}

// Lowers the band so that it takes about as many updates as were sent. False if nothing waits.
bool StreamPlan::begin_band() {
  if (waiting_count_ == 0) return false;
  const std::uint64_t enough = std::max(kFirstBand, sent_count_);
  std::uint64_t taken = 0;
  band_ = kErrorLevels;
  while (band_ > 0 && taken < enough) taken += waiting_[--band_];
  next_supercube_ = std::uint32_t(volume_->set().supercubes());
  next_brick_ = std::uint32_t(volume_->set().bricks().size()) - 1;
  return true;
}

// Puts an update into the batch, after the ancestors it lacks. False if the batch is full first; what went in is closed under parents all the same.
bool StreamPlan::take(const Place& place, Chunk& chunk) {
  if (sent_.contains(place.index)) return true;
  const SupercubeSet& set = volume_->set();
  const Diamond d(set.centre(place));
  for (int k = 0; k < d.row->parents; ++k) {
    const Vertex c = d.parent(k);
    if ((c.x | c.y | c.z) < 0) continue;
    const auto parent = set.find(c);  // its error is no smaller: wanted, and of this band or sent
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
  --waiting_count_;
  --waiting_[code.error_level()];
  return true;
}

std::optional<Batch> StreamPlan::next(std::size_t max_bytes) {
  const SupercubeSet& set = volume_->set();
  Chunk chunk;
  chunk.max_bytes = max_bytes;
  bool full = false;
  while (!full) {
    if (next_supercube_ == 0 && (chunk.bytes >= kSmallBatch || !begin_band())) break;
    const std::uint32_t s = --next_supercube_;
    const SupercubeSet::Brick* brick = &set.bricks()[next_brick_];
    if (s < brick->first_supercube) brick = &set.bricks()[--next_brick_];
    const UpdateIndex first = set.first(next_brick_, s);
    const std::uint64_t occupancy = set.occupancy()[s];
    const auto count = UpdateIndex(std::popcount(occupancy));
    bool any = false;
    for (UpdateIndex i = first; i < first + count; ++i) any = any || (volume_->error_level(i) >= band_ && wanted_.contains(i) && !sent_.contains(i));
    if (!any) continue;
    std::uint64_t mask = brick->mask;
    for (std::uint32_t skip = s - brick->first_supercube; skip > 0; --skip) mask &= mask - 1;
    const SupercubeKey key = brick->key + unsigned(std::countr_zero(mask));
    UpdateIndex i = first;
    for (std::uint64_t left = occupancy; left != 0 && !full; left &= left - 1, ++i) {
      if (volume_->error_level(i) < band_ || !wanted_.contains(i)) continue;
      full = !take({key, next_brick_, s, std::uint32_t(std::countr_zero(left)), i}, chunk);
    }
    if (full) next_supercube_ = s + 1;  // there is more of it
  }
  if (chunk.updates == 0) return {};
  std::vector<SlotGroup> groups;
  groups.reserve(chunk.groups.size());
  for (const auto& [supercube, group] : chunk.groups) groups.push_back(group);
  std::sort(groups.begin(), groups.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.supercube < b.supercube; });
  Batch batch;
  batch.payload = encode_batch(*volume_, sent_, groups);
  batch.updates = chunk.updates;
  for (unsigned level = kErrorLevels; level-- > 0;) {
    if (waiting_[level] == 0) continue;
    batch.remaining_error = volume_->error_levels()[level];
    break;
  }
  return batch;
}

}  // namespace intervale
