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
  supercube_bounds_.read(brick, count, bounds);
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
  if (bounds.has_changed && bounds.kept != 0) supercube_bounds_.write(brick, std::size_t(std::popcount(volume_->set().bricks()[brick].mask)), bounds);
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

// Bricks are ranked by bounds that are found fast. Those that come first are ranked again, as well as can be.
void StreamPlan::rank_bricks() {
  const Ranking::BrickBounds bounds(*ranking_);
  wanted_count_ = pending_bricks_ = 0;
  for (std::size_t begin = 0; begin < viewed_.size(); begin += bounds.kBlock) rank_block(begin, bounds);
  if (pending_bricks_ == 0) viewed_.release_all();
  begin_band();
}

// Ranks the bricks of a block, and counts what is wanted of them.
void StreamPlan::rank_block(std::size_t begin, const Ranking::BrickBounds& bounds) {
  constexpr std::size_t kBlock = Ranking::BrickBounds::kBlock;
  static_assert(decltype(viewed_)::begin_of(1) % kBlock == 0, "a block is within a page");
  std::uint32_t which = 0, kept = 0;  // bricks with something to send, and those that pending_ has
  std::array<unsigned, kBlock> unsent{};
  std::array<Ranking::Left, kBlock> left{};
  for (std::size_t k = 0; k < std::min(kBlock, viewed_.size() - begin); ++k) {
    const BrickIndex b{std::uint32_t(begin + k)};
    if (const auto found = pending_.find(b)) {
      const auto pending = bits_as<Pending>(*found);
      unsent[k] = pending.unsent;
      left[k] = this->left(pending);
      kept |= std::uint32_t(1) << k;
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
  if (top != 0 || viewed_.is_used(viewed_.page_of(begin))) {
    Viewed* const viewed = &viewed_.use(begin);
    for (std::size_t k = 0; k < kBlock; ++k) {
      viewed[k].rank = bound.rank[k] & 0x7fffU;
      viewed[k].is_loose = bounds.is_exact() ? 0 : 1;
      viewed[k].pixels = Up16(bound.pixels[k]);
      pending_bricks_ += std::uint32_t(bound.rank[k] != 0);
      wanted_count_ += bound.rank[k] != 0 ? unsent[k] : 0;
    }
  }
  for (const std::size_t k : set_bits<std::size_t>(kept)) {
    const BrickIndex b{std::uint32_t(begin + k)};
    Pending pending = this->pending(b);
    pending.wanted = bound.rank[k] != 0 ? pending.unsent : 0;
    keep(b, pending);
  }
}

void StreamPlan::refine(BrickIndex brick, const Ranking::Brick& ranking) {
  const Pending w = pending(brick);
  viewed_.use(brick).is_loose = 0;
  const Rank exact = ranking.bound(left(w));
  set_pending(brick, w, std::min<Rank>(viewed_[brick].rank, std::max(exact, budget_ ? Rank(1) : Rank(0))), w.wanted);
}

StreamPlan::Pending StreamPlan::first_pending(BrickIndex brick, const RelevantUpdates::Bound& bound) const {
  Pending first;
  first.set_unsent(bound.updates);
  first.wanted = viewed_[brick].rank == 0 ? 0 : first.unsent;
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
  wanted_count_ += wanted - std::uint64_t(pending.wanted);
  const Rank before = viewed_[brick].rank;
  if (rank != before) viewed_.use(brick).rank = rank & 0x7fffU;
  pending_bricks_ += std::uint32_t(rank != 0) - std::uint32_t(before != 0);
  if (pending_bricks_ == 0) viewed_.release_all();
  pending.wanted = wanted & 0xfffU;
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
  for (std::size_t page = viewed_.pages(); page-- != 0;) {  // coarse ones have high ranks, so that few others are refined
    if (!viewed_.is_used(page)) continue;
    Rank most = 0;
    for (std::size_t i = viewed_.end_of(page); i-- != viewed_.begin_of(page);) {
      const BrickIndex b{std::uint32_t(i)};
      if (viewed_[b].rank > top && viewed_[b].is_loose != 0) refine(b, ranking_->of_brick(b));
      most = std::max<Rank>(most, viewed_[b].rank);
      top = std::max(top, most);
    }
    if (most == 0) viewed_.release(page);
  }
  const bool is_rest = wanted_count_ < sent_count_ / kRest;
  band_ = top == 0 ? Rank(0) : ranking_->band_below(top, is_rest, band_width_);
}

StreamPlan::Remaining StreamPlan::remaining() const {
  Rank top = 0;
  unsigned error_step = 0;
  float pixels = 0;
  for (std::size_t page = 0; page < viewed_.pages(); ++page) {
    for (std::size_t i = viewed_.begin_of(page); viewed_.is_used(page) && i < viewed_.end_of(page); ++i) {
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
