#include <algorithm>
#include <atomic>

#include "common/front/front.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;
using Updates = std::array<UpdateView, kSlots>;

constexpr std::size_t kPiece = 32, kPiecesBetweenProgress = 512;  // in supercubes; in pieces

// Splits the diamonds of groups pass by pass: scale by scale, and class by class within a scale. Within a pass no
// diamond is another's ancestor, so its pieces can run on many threads: each writes its own splits and their cuts, and
// reads those of earlier passes.
class AllSplits {
 public:
  AllSplits(FrontState& state, std::span<const SlotGroup> groups, const Front::GroupUpdates& updates_of)
      : state_(state), groups_(groups), updates_of_(updates_of) {
    blocks_.reserve(groups.size());
    Updates updates;
    std::size_t points = state.q.size();
    for (const SlotGroup& g : groups) {
      Block& block = state.obtain_block(scale_of_key(g.key), position_of_key(g.key));
      blocks_.push_back(&block);
      updates_of(g, updates);
      for (const Slot slot : set_bits<Slot>(g.slots)) {
        block.of[slot].first = PointId(points);
        points += updates[slot].residuals.size() + 1;  // room for the centre, too
      }
      // Marked as split before it is written: readers come in later passes.
      block.split = block.shown = g.slots;
      splits_ += std::uint64_t(std::popcount(g.slots));
    }
    state.q.resize(points);
  }

  std::optional<Vertex> run(const ParallelFor& parallel, const OnProgress& progress) {
    for (std::size_t first = 0, last = 0; first < groups_.size(); first = last) {
      const int scale = scale_of_key(groups_[first].key);
      while (last < groups_.size() && scale_of_key(groups_[last].key) == scale) ++last;
      for (const std::uint64_t slots : kSlotsOfClass) {
        const std::size_t pieces = (last - first + kPiece - 1) / kPiece;
        for (std::size_t piece = 0; piece < pieces && !failed_; piece += kPiecesBetweenProgress) {
          parallel(std::min(kPiecesBetweenProgress, pieces - piece), [&](std::size_t i) {
            const std::size_t begin = first + (piece + i) * kPiece;
            split_piece(begin, std::min(last, begin + kPiece), slots);
          });
          if (progress) progress(double(done_.load()) / double(splits_));
        }
        if (failed_) return misfit_;
      }
    }
    state_.split_count += splits_;
    state_.shown_count += splits_;
    state_.tet_count += std::uint64_t(added_tets_.load());
    return {};
  }

 private:
  // Groups [begin, end), as far as their slots are among `slots`.
  void split_piece(std::size_t begin, std::size_t end, std::uint64_t slots) {
    FrontCursor cursor(state_);
    Updates updates;
    std::int64_t added = 0;
    std::uint64_t splits = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const std::uint64_t chosen = groups_[k].slots & slots;
      if (chosen == 0) continue;
      cursor.move_to(blocks_[k]->scale, blocks_[k]->position);
      updates_of_(groups_[k], updates);
      splits += std::uint64_t(std::popcount(chosen));
      for (const Slot slot : set_bits<Slot>(chosen)) {
        Split& split = blocks_[k]->of[slot];
        const bool is_there = cursor.gather(slot) && !cursor.is_noop();
        const std::optional<Side> side = is_there ? decode_update(cursor.gather_cuts(), updates[slot], &state_.q[split.first]) : std::nullopt;
        if (!side) {
          if (!failed_.exchange(true)) misfit_ = centre_of(groups_[k].key, slot);
          return;
        }
        split.bits = cursor.context().cut_bits(*side) | std::uint32_t(*side) << FrontState::kSideBit;
        added += cursor.added_tets(split);
      }
    }
    added_tets_ += added;
    done_ += splits;
  }

  FrontState& state_;
  std::span<const SlotGroup> groups_;
  const Front::GroupUpdates& updates_of_;
  std::vector<Block*> blocks_;  // by group
  std::uint64_t splits_ = 0;
  std::atomic<std::uint64_t> done_ = 0;
  std::atomic<std::int64_t> added_tets_ = 0;
  std::atomic<bool> failed_ = false;
  Vertex misfit_;  // written by the thread that sets failed_
};

}  // namespace

std::optional<Vertex> Front::split_all(std::span<const SlotGroup> groups, const GroupUpdates& updates_of, const ParallelFor& parallel,
                                       const OnProgress& progress) {
  return AllSplits(state_, groups, updates_of).run(parallel, progress);
}

}  // namespace intervale
