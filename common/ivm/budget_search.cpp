#include "common/ivm/budget_search.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr std::uint32_t kSlice = 1 << 15;  // visits: about a millisecond

}  // namespace

BudgetSearch::BudgetSearch(std::shared_ptr<const IntervalVolume> volume, std::shared_ptr<const RelevantUpdates> relevant, const Lod& lod)
    : owner_(std::move(volume)),
      relevant_owner_(std::move(relevant)),
      ranking_(volume_, relevant_, lod),
      around_(volume_.set()),
      budget_(lod.max_updates.value_or(0)),
      page_(volume_.size() / kPage + 1),
      result_(volume_.set()),
      slices_(search()) {}

bool BudgetSearch::go_on() noexcept {
  if (is_done()) return false;
  try {
    if (slices_.resume()) return true;
  } catch (...) {
    failure_ = std::current_exception();
  }
  is_done_.store(true, std::memory_order_release);
  return false;
}

SplitSet BudgetSearch::result() && {
  if (failure_) std::rethrow_exception(failure_);
  return std::move(result_);
}

bool BudgetSearch::is_time() {
  if (visited_ < kSlice) return false;
  visited_ = 0;
  return true;
}

void BudgetSearch::raise(UpdateIndex i, Rank rank) {
  std::uint32_t& page = page_[i / kPage];
  if (page == 0) {
    ranks_.emplace_back();
    page = std::uint32_t(ranks_.size());
  }
  Rank& known = ranks_[page - 1][i % kPage];
  known = std::max(known, rank);
}

// Ranks the updates that are wanted for their own sake.
void BudgetSearch::rank_brick(BrickIndex b) {
  ++visited_;
  const Ranking::Brick brick = ranking_.of_brick(b);
  if (brick.bound() == 0) return;
  const SupercubeSet& set = volume_.set();
  const BrickNeeds needs = relevant_.brick(b);
  std::size_t n = 0;
  set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
    const Ranking::Supercube ranking = brick.supercube(needs, s, key);
    const std::uint64_t occupancy = set.occupancy()[s], slots = needs.slots(n++, occupancy);
    visited_ += unsigned(std::popcount(occupancy));
    UpdateIndex i = set.first(b, s);
    for (const Slot slot : set_bits<Slot>(occupancy)) {
      if ((slots >> slot & 1) != 0) {
        if (const Rank rank = ranking(i, slot); rank != 0) raise(i, rank);
      }
      ++i;
    }
  });
}

// Gives ancestors at least the ranks of their descendants; from fine to coarse.
void BudgetSearch::raise_parents(BrickIndex brick, std::uint64_t of_class) {
  const SupercubeSet& set = volume_.set();
  set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
    ++visited_;
    const std::uint64_t occupancy = set.occupancy()[s];
    const UpdateIndex first = set.first(brick, s);
    for (const Slot slot : set_bits<Slot>(occupancy & of_class)) {
      ++visited_;
      const Rank rank = rank_of(first + count_below(occupancy, slot));
      if (rank == 0) continue;
      around_.move_to(key);
      const Links& links = around_.links(slot);
      const int parents = diamond_type(kTypeOfSlot[slot]).parents;
      visited_ += unsigned(parents);
      for (int k = 0; k < parents; ++k) {
        const Link link = links.vertex[links.parent[std::size_t(k)]];
        const SetFinder::Found& found = around_.at(link.where);
        if (found.has(link.slot)) raise(found.index(link.slot), rank);
      }
    }
  });
}

// Puts the updates of a class that are within the budget into the result; from coarse to fine.
void BudgetSearch::take(BrickIndex brick, std::uint64_t of_class) {
  const SupercubeSet& set = volume_.set();
  set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
    ++visited_;
    const std::uint64_t occupancy = set.occupancy()[s];
    const UpdateIndex first = set.first(brick, s);
    std::uint64_t taken = 0;
    for (const Slot slot : set_bits<Slot>(occupancy & of_class)) {
      ++visited_;
      const UpdateIndex i = first + count_below(occupancy, slot);
      const Rank rank = rank_of(i);
      if (rank == 0 || rank < last_ || (rank == last_ && budget_ == 0)) continue;
      if (rank == last_) --budget_;
      taken |= std::uint64_t(1) << slot;
    }
    result_.insert(brick, key, taken);
  });
}

Slices BudgetSearch::search() {
  const SupercubeSet& set = volume_.set();
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    rank_brick(b);
    if (is_time()) co_await Slices::kPause;
  }
  for (int scale = 0; scale < kMaxLevels; ++scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (int cls = 2; cls >= 0; --cls) {
      for (BrickIndex b = begin; b < end; ++b) {
        raise_parents(b, kSlotsOfClass[std::size_t(cls)]);
        if (is_time()) co_await Slices::kPause;
      }
    }
  }
  // The rank at which the budget is used up, by its high byte and then by its low byte.
  constexpr unsigned kByte = 256;
  unsigned high = 0;
  for (const bool is_low : {false, true}) {
    std::array<std::uint64_t, kByte> counts{};
    for (const auto& page : ranks_) {
      for (const Rank rank : page) {
        if (!is_low) ++counts[rank / kByte];
        if (is_low && rank / kByte == high) ++counts[rank % kByte];
      }
      visited_ += kPage / 8;
      if (is_time()) co_await Slices::kPause;
    }
    unsigned byte = kByte - 1;
    for (; byte > 0 && counts[byte] <= budget_; --byte) budget_ -= counts[byte];
    last_ = Rank(is_low ? high * kByte + byte : 0);
    high = is_low ? high : byte;
  }
  for (int scale = kMaxLevels - 1; scale >= 0; --scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (const std::uint64_t of_class : kSlotsOfClass) {
      for (BrickIndex b = begin; b < end; ++b) {
        take(b, of_class);
        if (is_time()) co_await Slices::kPause;
      }
    }
  }
}

}  // namespace intervale
