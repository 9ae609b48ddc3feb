// The updates within a budget, found in slices: a server does other work in between.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <vector>

#include "common/diamond/split_set.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/ranking.h"
#include "common/util/slices.h"
#include "common/view/lod.h"

namespace intervale {

// Finds the first lod.max_updates of in_order() (refinement.h), or all if there are fewer. Memory while it searches: two
// bytes for each update wanted, in pages. One thread at a time, except is_done().
class BudgetSearch {
 public:
  // lod.max_updates is given. relevant: of that volume.
  BudgetSearch(std::shared_ptr<const IntervalVolume> volume, std::shared_ptr<const RelevantUpdates> relevant, const Lod& lod);
  BudgetSearch(const BudgetSearch&) = delete;
  BudgetSearch& operator=(const BudgetSearch&) = delete;

  // Searches for about a millisecond, unless it is done. Returns whether there is more to do.
  bool go_on() noexcept;
  // Any thread.
  [[nodiscard]] bool is_done() const { return is_done_.load(std::memory_order_acquire); }
  // Of the search, besides the volume and what is relevant. Between slices.
  [[nodiscard]] std::size_t memory_bytes() const {
    return sizeof *this + ranking_.memory_bytes() + page_.capacity() * sizeof page_[0] + ranks_.size() * sizeof ranks_[0] + result_.memory_bytes();
  }
  // Once it is done; closed under parents. Throws what prevented it, for example that memory is exhausted.
  [[nodiscard]] SplitSet result() &&;

 private:
  using Rank = Ranking::Rank;
  static constexpr std::uint32_t kPage = 4096;
  Slices search();
  void rank_brick(BrickIndex brick);
  void raise_parents(BrickIndex brick, std::uint64_t of_class);
  void take(BrickIndex brick, std::uint64_t of_class);
  [[nodiscard]] bool is_time();
  [[nodiscard]] Rank rank_of(UpdateIndex i) const {
    const std::uint32_t page = page_[i / kPage];
    return page == 0 ? Rank(0) : ranks_[page - 1][i % kPage];
  }
  void raise(UpdateIndex i, Rank rank);

  const std::shared_ptr<const IntervalVolume> owner_;
  const std::shared_ptr<const RelevantUpdates> relevant_owner_;
  const IntervalVolume& volume_ = *owner_;
  const RelevantUpdates& relevant_ = *relevant_owner_;
  Ranking ranking_;
  SetNeighbours around_;
  std::uint64_t budget_;                       // updates that are left
  Rank last_ = 0;                              // all of a higher rank are within the budget, and none of a lower one
  std::vector<std::uint32_t> page_;            // of each kPage numbers, counted from 1; 0: their ranks are 0
  std::deque<std::array<Rank, kPage>> ranks_;  // by page; 0: not wanted, not even as an ancestor
  SplitSet result_;
  std::uint32_t visited_ = 0;  // in this slice: supercubes and updates
  std::atomic<bool> is_done_{false};
  std::exception_ptr failure_;
  Slices slices_;  // the last member: it uses the others
};

}  // namespace intervale
