// What is known of the updates that were not sent: bounds by brick and by supercube, and the bands that follow from them.
//
// A view that differs little from the one before should find at once what it lacks. So bounds outlive views, and do not
// say how steep updates are that no view near by wants.
#include <algorithm>
#include <array>
#include <bit>

#include "common/selection/stream_plan.h"

namespace intervale {
namespace {

// A brick's limit, relative to the object errors that are wanted there: at first, and the least that is kept.
constexpr float kLimit = 1.3F, kLeastLimit = 0.95F;

}  // namespace

StreamPlan::InBrick StreamPlan::in_brick(BrickIndex brick, SupercubeIndex s) const {
  const SupercubeSet::Brick& b = volume_->set().bricks()[brick];
  return {relevant_->brick(brick), s - b.first_supercube, scale_of_key(b.key), relevant_->distance(pending_[brick].limit)};
}

StreamPlan::Highest StreamPlan::of_relevant(const InBrick& in) {
  return {in.needs.error_step(in.number), in.needs.distance(in.number), in.needs.slope(in.number), 0};
}

StreamPlan::Highest StreamPlan::highest(const InBrick& in, SupercubeIndex s) const {
  const auto steps = highest_steps_.find(s);
  if (!steps) return of_relevant(in);
  const std::uint8_t distance = relevant_->has_distances() ? highest_distances_.find(s).value_or(0) : std::uint8_t(0);
  return {std::uint8_t(*steps >> 8), distance, std::uint8_t(*steps & 15U), std::uint8_t(*steps >> 4 & 15U)};
}

std::array<StreamPlan::Highest, StreamPlan::kBrick> StreamPlan::highest_of(BrickIndex brick, const BrickNeeds& needs) const {
  const SupercubeSet::Brick& b = volume_->set().bricks()[brick];
  const std::size_t first = b.first_supercube, count = std::size_t(std::popcount(b.mask));
  std::array<Highest, kBrick> highest;
  for (std::size_t n = 0; n < count; ++n) highest[n] = of_relevant({needs, n});
  highest_steps_.for_each_in(first, first + count, [&](std::size_t s, std::uint16_t steps) {
    highest[s - first] = {std::uint8_t(steps >> 8), 0, std::uint8_t(steps & 15U), std::uint8_t(steps >> 4 & 15U)};
  });
  highest_distances_.for_each_in(first, first + (relevant_->has_distances() ? count : 0),
                                 [&](std::size_t s, std::uint8_t distance) { highest[s - first].distance = distance; });
  return highest;
}

void StreamPlan::set_highest(const InBrick& in, SupercubeIndex s, Highest to) {
  if (!highest_steps_.find(s) && to == of_relevant(in)) return;
  highest_steps_.set(s, std::uint16_t(to.error_step << 8 | to.slope_below << 4 | to.slope));
  if (relevant_->has_distances()) highest_distances_.set(s, to.distance);
}

// Sets a brick's limit again if it is not near what a view wants there. highest: of the brick, which it changes.
void StreamPlan::move_limit(BrickIndex brick, const Ranking::Brick& ranking, std::array<Highest, kBrick>& highest) {
  Pending& pending = pending_[brick];
  const float limit = relevant_->distance(pending.limit), unwanted = ranking.unwanted();
  if (limit >= kLeastLimit * unwanted && limit <= Ranking::Left::kHardly * unwanted) return;
  const std::uint8_t to = relevant_->code_below(kLimit * unwanted);
  if (to == pending.limit) return;
  const bool is_lower = to < pending.limit;
  pending.limit = to;
  if (is_lower)
    pending.slope = std::max<unsigned>(pending.slope, pending.slope_below) & 15U;
  else
    pending.slope_below = std::max<unsigned>(pending.slope, pending.slope_below) & 15U;
  const SupercubeSet::Brick& b = volume_->set().bricks()[brick];
  const std::size_t first = b.first_supercube;
  highest_steps_.change_each_in(first, first + std::size_t(std::popcount(b.mask)), [&](std::size_t s, std::uint16_t steps) {
    Highest& h = highest[s - first];
    (is_lower ? h.slope : h.slope_below) = std::max(h.slope, h.slope_below);
    return std::uint16_t((steps & 0xff00U) | unsigned(h.slope_below) << 4 | h.slope);
  });
}

void StreamPlan::Pending::raise_to(const Highest& highest, float error) {
  error_step = std::max(error_step, highest.error_step);
  slope = std::max<unsigned>(slope, highest.slope) & 15U;
  slope_below = std::max<unsigned>(slope_below, highest.slope_below) & 15U;
  object_error = Up16(std::max(float(object_error), error));
}

void StreamPlan::Pending::lower_to(const Highest& highest, float error) {
  error_step = std::min(error_step, highest.error_step);
  slope = highest.slope & 15U;
  slope_below = highest.slope_below & 15U;
  object_error = Up16(std::min(float(object_error), error));
}

// Bricks are ranked by bounds that are found fast. Those that come first are ranked again, as well as can be.
void StreamPlan::rank_bricks() {
  Ranking::BrickBounds bounds(*ranking_);
  for (BrickIndex b{0}; b < pending_.size(); ++b) {
    Pending& w = pending_[b];
    if (w.unsent == 0) continue;
    const auto bound = bounds(b, left(w));
    w.pixels = Up16(bound.pixels);
    is_loose_[b] = !bound.is_exact;
    set_pending(b, std::max(bound.rank, budget_ ? Rank(1) : Rank(0)), w.unsent);
  }
  begin_band();
}

void StreamPlan::refine(BrickIndex brick, const Ranking::Brick& ranking) {
  const Pending& w = pending_[brick];
  is_loose_[brick] = false;
  const Rank exact = ranking.bound(left(w));
  set_pending(brick, std::min(w.rank, std::max(exact, budget_ ? Rank(1) : Rank(0))), w.wanted);
}

void StreamPlan::set_pending(BrickIndex brick, Rank rank, unsigned wanted) {
  Pending& w = pending_[brick];
  if (w.unsent == 0) rank = 0;
  wanted = rank == 0 ? 0 : std::min<unsigned>(wanted, w.unsent);
  wanted_count_ += wanted - std::uint64_t(w.wanted);
  pending_bricks_ += std::uint32_t(rank != 0) - std::uint32_t(w.rank != 0);
  w.rank = rank;
  w.wanted = wanted & 0xfffU;
}

void StreamPlan::begin_band() {
  next_brick_ = std::uint32_t(pending_.size());
  Rank top = 0;
  for (std::uint32_t next = next_brick_; next != 0; --next) {  // coarse ones have high ranks, so that few others are refined
    const BrickIndex b(next - 1);
    if (pending_[b].rank > top && is_loose_[b]) refine(b, ranking_->of_brick(b));
    top = std::max(top, pending_[b].rank);
  }
  band_ = top == 0 ? Rank(0) : ranking_->band_below(top);
}

StreamPlan::Remaining StreamPlan::remaining() const {
  Rank top = 0;
  for (const Pending& w : pending_) top = std::max(top, w.rank);
  Remaining remaining{wanted_count_, 0, 0};
  if (top == 0) return remaining;
  if (!ranking_->has_camera()) {
    remaining.error = ranking_->error(top);
    return remaining;
  }
  unsigned error_step = 0;
  for (const Pending& w : pending_) {
    if (w.rank == 0) continue;
    error_step = std::max(error_step, unsigned(w.error_step));
    remaining.pixels = std::max(remaining.pixels, double(float(w.pixels)));
  }
  remaining.error = volume_->error_steps()[error_step];
  return remaining;
}

}  // namespace intervale
