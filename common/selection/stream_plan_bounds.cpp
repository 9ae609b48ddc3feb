// What is known of the updates that were not sent: bounds by brick and by supercube, and the bands that follow from
// them.
//
// A view that differs little from the one before should find at once what it lacks. So bounds outlive views, and do not
// say how steep updates are that no view near by wants.
#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "common/selection/stream_plan.h"

namespace intervale {
namespace {

// A brick's limit, relative to the object errors that are wanted there: at first, and the least that is kept.
constexpr float kLimit = 1.3F, kLeastLimit = 0.95F;

// A band was in vain after so many visits, if they found less than one update in so many.
constexpr std::uint64_t kManyVisits = 1 << 13, kVisitsInVain = 64;

}  // namespace

StreamPlan::InBrick StreamPlan::in_brick(BrickIndex brick, SupercubeIndex s) const {
  const SupercubeSet::Brick& b = volume_->set().bricks()[brick];
  return {relevant_->brick(brick), s - b.first_supercube, scale_of_key(b.key), relevant_->distance(pending(brick).limit)};
}

StreamPlan::Bounds StreamPlan::bounds_of(BrickIndex brick, const BrickNeeds& needs) const {
  const auto count = std::size_t(std::popcount(volume_->set().bricks()[brick].mask));
  Bounds bounds;
  for (std::size_t n = 0; n < count; ++n) {
    const BrickNeeds::Highest all = needs.highest(n);
    bounds.highest[n] = {all.error_step, all.distance, all.slope, 0};
  }
  supercube_bounds_.read(brick, bounds);
  const std::uint8_t then = std::exchange(bounds.time, time_);
  if (bounds.kept == 0 || then == time_) return bounds;
  RelevantUpdates::PartMask added = 0;
  for (std::size_t i = 0; i < part_since_.size(); ++i) added |= RelevantUpdates::PartMask(unsigned(part_since_[i] > then) << i);
  const BrickNeeds needs_of_added = relevant_->brick(brick, added);
  for (const std::size_t n : set_bits<std::size_t>(bounds.kept)) {
    const BrickNeeds::Highest more = needs_of_added.highest(n);
    bounds.highest[n].raise({more.error_step, more.distance, more.slope, 0});
  }
  return bounds;
}

void StreamPlan::keep(BrickIndex brick, const Bounds& bounds) {
  // Those that were all dropped may stay: they are never too low.
  if (bounds.has_changed && bounds.kept != 0) supercube_bounds_.write(brick, bounds);
}

void StreamPlan::Bounds::set(std::size_t number, const Highest& to) {
  if (highest[number] == to) return;
  highest[number] = to;
  kept |= std::uint64_t(1) << number;
  has_changed = true;
}

void StreamPlan::Bounds::drop(std::size_t number) {
  const std::uint64_t others = kept & ~(std::uint64_t(1) << number);
  has_changed = has_changed || others != kept;
  kept = others;
}

// Sets a brick's limit again if it is not near what a view wants there. bounds: of the brick.
void StreamPlan::move_limit(const Ranking::Brick& ranking, Pending& pending, Bounds& bounds) const {
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
  for (const std::size_t n : set_bits<std::size_t>(bounds.kept)) {
    Highest& h = bounds.highest[n];
    (is_lower ? h.slope : h.slope_below) = std::max(h.slope, h.slope_below);
    bounds.has_changed = true;
  }
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

// Runs of bricks are ranked by bounds that are found fast; then the bricks of those that come first, likewise; and of
// these again those that come first, as well as can be.
void StreamPlan::rank_runs() {
  constexpr std::size_t kBlock = Ranking::BlockBounds::kBlock;
  const Ranking::BlockBounds bounds(*ranking_, Ranking::BlockBounds::Of::runs);
  wanted_count_ = pending_bricks_ = 0;
  viewed_.release_all();
  viewed_runs_.assign(viewed_.pages(), {});
  for (std::size_t begin = 0; begin < viewed_runs_.size(); begin += kBlock) {
    std::uint32_t which = 0;
    std::array<RelevantUpdates::RunBound, kBlock> all{};
    std::array<Ranking::Left, kBlock> left{};
    for (std::size_t k = 0; k < std::min(kBlock, viewed_runs_.size() - begin); ++k) {
      all[k] = relevant_->run_bound(begin + k);
      left[k] = {all[k].error_step, all[k].object_error, all[k].slope};
      which |= std::uint32_t(all[k].updates != 0) << k;
    }
    const auto bound = bounds(begin / kBlock, which, left);
    for (const std::size_t k : set_bits<std::size_t>(which)) {
      const Rank rank = budget_ ? std::max(bound.rank[k], Rank(1)) : bound.rank[k];
      if (rank == 0) continue;
      viewed_runs_[begin + k] = {rank, Up16(bound.pixels[k])};
      ++pending_bricks_;
      wanted_count_ += all[k].updates;
    }
  }
  begin_band();
}

void StreamPlan::rank_bricks(std::size_t run) {
  viewed_runs_[run] = {};
  wanted_count_ -= relevant_->run_bound(run).updates;
  const Ranking::BlockBounds bounds(*ranking_, Ranking::BlockBounds::Of::bricks);
  for (std::size_t begin = viewed_.begin_of(run); begin < viewed_.end_of(run); begin += bounds.kBlock) rank_block(begin, bounds);
  if (--pending_bricks_ == 0) viewed_.release_all();
}

void StreamPlan::rank_block(std::size_t begin, const Ranking::BlockBounds& bounds) {
  constexpr std::size_t kBlock = Ranking::BlockBounds::kBlock;
  static_assert(RelevantUpdates::kRun % kBlock == 0, "a block is within a page");
  std::uint32_t which = 0;  // bricks with something to send
  std::array<unsigned, kBlock> unsent{};
  std::array<Ranking::Left, kBlock> left{};
  for (std::size_t k = 0; k < std::min(kBlock, viewed_.size() - begin); ++k) {
    const BrickIndex b{std::uint32_t(begin + k)};
    if (const auto found = pending_.find(b)) {
      const auto pending = bits_as<Pending>(*found);
      unsent[k] = pending.unsent;
      left[k] = this->left(pending);
    } else {
      const RelevantUpdates::Bound all = relevant_->bound(b);
      unsent[k] = all.updates;
      left[k] = {all.error_step, all.object_error, all.slope};
    }
    which |= std::uint32_t(unsent[k] != 0) << k;
  }
  auto bound = bounds(begin / kBlock, which, left);
  Rank top = 0;
  for (const std::size_t k : set_bits<std::size_t>(which)) {
    if (budget_) bound.rank[k] = std::max(bound.rank[k], Rank(1));
    top = std::max(top, bound.rank[k]);
  }
  if (top == 0) return;
  Viewed* const viewed = &viewed_.use(begin);
  for (std::size_t k = 0; k < kBlock; ++k) {
    viewed[k].rank = bound.rank[k] & 0x7fffU;
    viewed[k].is_loose = bounds.is_exact() ? 0 : 1;
    viewed[k].pixels = Up16(bound.pixels[k]);
    viewed[k].wanted = std::uint16_t(bound.rank[k] != 0 ? unsent[k] : 0);
    pending_bricks_ += std::uint32_t(bound.rank[k] != 0);
    wanted_count_ += viewed[k].wanted;
  }
}

void StreamPlan::refine(BrickIndex brick, const Ranking::Brick& ranking) {
  const Pending w = pending(brick);
  Viewed& viewed = viewed_.use(brick);
  viewed.is_loose = 0;
  const Rank exact = ranking.bound(left(w));
  set_pending(brick, w, std::min<Rank>(viewed.rank, std::max(exact, budget_ ? Rank(1) : Rank(0))), viewed.wanted);
}

StreamPlan::Pending StreamPlan::first_pending(const RelevantUpdates::Bound& bound) {
  Pending first;
  first.set_unsent(bound.updates);
  first.raise_to({bound.error_step, 0, bound.slope, 0}, bound.object_error);
  return first;
}

void StreamPlan::keep(BrickIndex brick, const Pending& pending) {
  const auto bits = bits_as<std::uint64_t>(pending);
  if (bits != bits_as<std::uint64_t>(this->pending(brick))) pending_.set(brick, bits);
}

void StreamPlan::set_pending(BrickIndex brick, Pending pending, Rank rank, unsigned wanted) {
  if (pending.unsent == 0) rank = 0;
  wanted = rank == 0 ? 0 : std::min<unsigned>(wanted, pending.unsent);
  const Viewed before = viewed_[brick];
  if (rank != before.rank || wanted != before.wanted) {
    Viewed& viewed = viewed_.use(brick);
    viewed.rank = rank & 0x7fffU;
    viewed.wanted = std::uint16_t(wanted);
    wanted_count_ += wanted - std::uint64_t(before.wanted);
    pending_bricks_ += std::uint32_t(rank != 0) - std::uint32_t(before.rank != 0);
    if (pending_bricks_ == 0) viewed_.release_all();
  }
  keep(brick, pending);
}

// Where a client has nearly all that its view wants, as while it drags a range, bands find next to nothing; the order
// of so few updates does not matter, and each band costs a visit of many bricks. The next view most likely is like that,
// too: the width is kept.
void StreamPlan::begin_band() {
  const bool was_in_vain = band_visits_ > kManyVisits && band_visits_ > kVisitsInVain * band_updates_;
  band_width_ = was_in_vain ? std::min(2 * band_width_, Ranking::kMostWidth) : 1;
  band_visits_ = band_updates_ = 0;
  next_brick_ = std::uint32_t(viewed_.size());
  Rank top = 0;
  // Coarse runs come first and rank high, so that the bricks of few others are ranked.
  for (std::size_t run = 0; run < viewed_runs_.size(); ++run) {
    if (viewed_runs_[run].rank > top) rank_bricks(run);
    if (!viewed_.is_used(run)) continue;
    Rank most = 0;
    for (std::size_t i = viewed_.begin_of(run); i < viewed_.end_of(run); ++i) {
      const BrickIndex b{std::uint32_t(i)};
      if (viewed_[b].rank > top && viewed_[b].is_loose != 0) refine(b, ranking_->of_brick(b));
      most = std::max<Rank>(most, viewed_[b].rank);
      top = std::max(top, most);
    }
    if (most == 0) viewed_.release(run);
  }
  const bool is_rest = wanted_count_ < sent_count_ / kRest;
  band_ = top == 0 ? Rank(0) : ranking_->band_below(top, is_rest, band_width_);
}

StreamPlan::Remaining StreamPlan::remaining() const {
  Rank top = 0;
  unsigned error_step = 0;
  float pixels = 0;
  for (std::size_t run = 0; run < viewed_runs_.size(); ++run) {
    if (viewed_runs_[run].rank != 0) {
      top = std::max(top, viewed_runs_[run].rank);
      pixels = std::max(pixels, float(viewed_runs_[run].pixels));
      error_step = std::max<unsigned>(error_step, relevant_->run_bound(run).error_step);
      continue;
    }
    for (std::size_t i = viewed_.begin_of(run); viewed_.is_used(run) && i < viewed_.end_of(run); ++i) {
      const Viewed& viewed = viewed_[i];
      if (viewed.rank == 0) continue;
      top = std::max<Rank>(top, viewed.rank);
      pixels = std::max(pixels, float(viewed.pixels));
      const BrickIndex b{std::uint32_t(i)};
      if (ranking_->has_camera() && relevant_->bound(b).error_step > error_step) error_step = std::max<unsigned>(error_step, pending(b).error_step);
    }
  }
  if (top == 0) return {wanted_count_, 0, 0};
  if (!ranking_->has_camera()) return {wanted_count_, ranking_->error(top), 0};
  return {wanted_count_, volume_->error_steps()[error_step], double(pixels)};
}

}  // namespace intervale
