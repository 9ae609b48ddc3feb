#include "client/core/stream_client.h"

#include <algorithm>

#include "common/front/batch_decoder.h"

namespace intervale {

Result<StreamClient> StreamClient::start(Description description, const Budget& budget, const RangeRequest& request) {
  if (auto ok = check_description(description); !ok) return tl::unexpected(ok.error());
  const ShownRanges shown = resolve(description, request);
  if (auto held = check_held(description, shown); !held) return tl::unexpected(held.error());
  std::vector<Front> fronts;
  fronts.reserve(kMaxRanges);
  for (const ShownRange& one : shown) fronts.emplace_back(description.grid, description.format, description.corners, one.range, one.refine);
  return StreamClient(std::move(description), std::move(fronts), budget);
}

Result<void> StreamClient::apply(std::span<const std::uint8_t> payload, std::uint64_t epoch, const RangeRequest& shown, const ChannelPart& channels) {
  keep_to_budget(epoch);
  forget(epoch);
  const std::uint64_t before = updates();
  if (!payload.empty() || channels.bytes.empty()) {
    const auto applied = apply_batch(fronts_, description_, resolve(description_, shown), payload, budget_.max_tets);
    if (!applied) return tl::unexpected(applied.error());
  }
  if (!channels.bytes.empty()) {
    std::vector<ChannelValues*> named;
    for (const std::size_t number : channels.numbers) named.push_back(&channels_[number]);
    if (auto taken = apply_channels(named, fronts_[0], payload, channels.bytes); !taken) return taken;
  }
  if (updates() > std::max(before, budget_.max_updates)) return fail("more updates than the room that the view names");
  if (over_budget()) rebalance();
  return {};
}

Result<void> StreamClient::show(const RangeRequest& request) {
  const ShownRanges shown = resolve(description_, request);
  const auto is_shown = [](const Front& front, const ShownRange& one) { return one == ShownRange{front.range(), front.refine()}; };
  if (std::equal(fronts_.begin(), fronts_.end(), shown.begin(), shown.end(), is_shown)) return {};
  if (auto held = check_held(description_, shown); !held) return held;
  while (fronts_.size() > shown.size()) fronts_.pop_back();
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (i == fronts_.size()) {
      fronts_.push_back(fronts_[0]);
    } else if (is_shown(fronts_[i], shown[i]) && fronts_[i].withheld_count() == 0) {
      continue;
    }
    fronts_[i].set_range(shown[i].range, shown[i].refine, tets_left(fronts_, i, budget_.max_tets));
  }
  rebalance();
  return {};
}

std::vector<Mesh> StreamClient::meshes() const {
  std::vector<Mesh> meshes;
  meshes.reserve(fronts_.size());
  std::vector<MeshChannel> channels;
  for (const std::size_t number : shown_channels_) channels.push_back(channels_[number].for_mesh());
  for (const Front& front : fronts_) meshes.push_back(front.mesh(serial, channels));
  return meshes;
}

std::uint64_t StreamClient::sum(std::uint64_t (Front::*count)() const) const {
  std::uint64_t sum = 0;
  for (const Front& front : fronts_) sum += (front.*count)();
  return sum;
}

void StreamClient::look(const Camera& camera, const std::optional<Box>& region) {
  importance_ = size_on_screen(camera, description_.grid);
  const bool had_region = region_.has_value();
  region_.reset();
  if (region) region_.emplace(*region, description_.grid);
  if (had_region && !region_) show_all();
  rebalance();
}

// As far as there is room.
void StreamClient::show_all() {
  for (std::size_t i = 0; i < fronts_.size(); ++i) {
    Front& front = fronts_[i];
    if (front.withheld_count() > 0) front.set_range(front.range(), front.refine(), tets_left(fronts_, i, budget_.max_tets));
  }
}

void StreamClient::set_budget(const Budget& budget, std::uint64_t epoch) {
  if (budget == Budget{budget_.max_tets, less_room_ ? less_room_->max_updates : budget_.max_updates}) return;
  budget_.max_tets = budget.max_tets;
  less_room_.reset();
  if (budget.max_updates < budget_.max_updates) {
    less_room_ = {epoch, budget.max_updates};
  } else {
    budget_.max_updates = budget.max_updates;
  }
  rebalance();
}

void StreamClient::keep_to_budget(std::uint64_t epoch) {
  if (!less_room_ || epoch < less_room_->epoch) return;
  budget_.max_updates = less_room_->max_updates;
  less_room_.reset();
}

void StreamClient::rebalance() {
  if (importance_ && (region_ || over_budget())) balance(fronts_, budget_.max_tets, importance_, region_ ? &*region_ : nullptr);
}

std::vector<SlotGroup> StreamClient::give_up(std::uint64_t epoch, std::size_t max_supercubes) {
  const std::uint64_t room = less_room_ ? less_room_->max_updates : budget_.max_updates;
  const std::uint64_t most = room - std::max<std::uint64_t>(1, room / 4);
  if (!importance_ || !forget_.empty() || updates() <= most) return {};
  forget_ = least_important(fronts_[0], updates() - most, max_supercubes, importance_);
  forget_epoch_ = epoch;
  return forget_;
}

void StreamClient::arrived(std::uint64_t epoch) {
  keep_to_budget(epoch);
  if (forget(epoch)) rebalance();
}

bool StreamClient::forget(std::uint64_t epoch) {
  if (forget_.empty() || epoch < forget_epoch_) return false;
  for (Front& front : fronts_) front.forget(forget_);
  for (ChannelValues& channel : channels_) channel.keep_split(fronts_[0], forget_);
  forget_.clear();
  return true;
}

}  // namespace intervale
