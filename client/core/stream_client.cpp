#include "client/core/stream_client.h"

#include <algorithm>

#include "common/front/batch_decoder.h"

namespace intervale {

Result<StreamClient> StreamClient::start(Description description, const Budget& budget, const RangeRequest& request) {
  if (auto ok = check_description(description); !ok) return tl::unexpected(ok.error());
  const ShownRange shown = resolve(description, request);
  if (auto held = check_held(description, shown); !held) return tl::unexpected(held.error());
  Front front(description.grid, description.format, description.corners, shown.range, shown.refine);
  return StreamClient(std::move(description), std::move(front), budget);
}

Result<void> StreamClient::apply(std::span<const std::uint8_t> payload, std::uint64_t epoch, const RangeRequest& shown) {
  keep_to_budget(epoch);
  forget(epoch);
  const std::uint64_t before = updates();
  const auto applied = apply_batch(front_, description_, resolve(description_, shown), payload, budget_.max_tets);
  if (!applied) return tl::unexpected(applied.error());
  if (updates() > std::max(before, budget_.max_updates)) return fail("more updates than the room that the view names");
  rebalance();
  return {};
}

Result<void> StreamClient::show(const RangeRequest& request) {
  const ShownRange shown = resolve(description_, request);
  if (shown == ShownRange{front_.range(), front_.refine()}) return {};
  if (auto held = check_held(description_, shown); !held) return held;
  front_.set_range(shown.range, shown.refine, budget_.max_tets);
  rebalance();
  return {};
}

void StreamClient::look(const Camera& camera) {
  importance_ = size_on_screen(camera, description_.grid);
  rebalance();
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
  if (importance_ && over_budget()) balance(front_, budget_.max_tets, importance_);
}

std::vector<SlotGroup> StreamClient::give_up(std::uint64_t epoch, std::size_t max_supercubes) {
  const std::uint64_t room = less_room_ ? less_room_->max_updates : budget_.max_updates;
  const std::uint64_t most = room - std::max<std::uint64_t>(1, room / 4);
  if (!importance_ || !forget_.empty() || updates() <= most) return {};
  forget_ = least_important(front_, updates() - most, max_supercubes, importance_);
  forget_epoch_ = epoch;
  return forget_;
}

void StreamClient::arrived(std::uint64_t epoch) {
  keep_to_budget(epoch);
  if (forget(epoch)) rebalance();
}

bool StreamClient::forget(std::uint64_t epoch) {
  if (forget_.empty() || epoch < forget_epoch_) return false;
  front_.forget(std::exchange(forget_, {}));
  return true;
}

}  // namespace intervale
