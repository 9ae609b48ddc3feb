// All that a front shows for a range, made at once from the keys of its splits.
//
// Passes over the supercubes, each of which many threads can share: the sides of the centres; which diamonds count;
// ancestors of those, from the finest scale on and class by class, so that a parent is complete before its own parents
// follow; then the points of what is shown. Only the first pass visits supercubes whose diamonds are all on one side.
// What counts is looked at with its vertices once: its cuts, and the tetrahedra that it adds, are kept until its points
// are placed.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <optional>
#include <vector>

#include "common/front/corners.h"
#include "common/front/front.h"
#include "common/front/shown_splits.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;

constexpr std::size_t kPiece = 32;  // supercubes

// Makes what is shown of a front from its splits and their keys, whatever was shown before.
class Reclassification {
 public:
  Reclassification(FrontState& state, const ParallelFor& parallel) : state_(state), values_(state.values), parallel_(parallel) {}

  void run() {
    place_corners(state_);
    find_sides();
    find_counting();
    show_ancestors();
    place_points();
    values_.withheld = 0;
    values_.is_limited = false;
    ++state_.point_generation;
  }

 private:
  using Around = SupercubeNeighbours<BlockFinderOf<FrontState>>;

  // Calls visit(begin, end, piece) for pieces of [0, count).
  template <class Visit>
  void for_each_piece(std::size_t count, const Visit& visit) const {
    parallel_((count + kPiece - 1) / kPiece, [&](std::size_t piece) { visit(piece * kPiece, std::min(count, (piece + 1) * kPiece), piece); });
  }

  // The side of all centres and vertices of a supercube's diamonds, if it is one.
  [[nodiscard]] std::optional<Side> side_of_all(const Block& block) const {
    const Side side = values_.sides.side(block.least);
    return side == values_.sides.side(block.greatest) ? std::optional(side) : std::nullopt;
  }

  // The sides of all centres. Finds the supercubes where diamonds may count.
  void find_sides() {
    std::vector<std::vector<std::uint32_t>> found((state_.blocks.size() + kPiece - 1) / kPiece);
    for_each_piece(state_.blocks.size(), [&](std::size_t begin, std::size_t end, std::size_t piece) {
      for (std::size_t number = std::max<std::size_t>(1, begin); number < end; ++number) {  // the first has the corners
        Block& block = state_.blocks[number];
        block.shown = block.counts = 0;
        const std::optional<Side> all = side_of_all(block);
        if (all) {
          block.above = *all == Side::above ? block.split : 0;
          block.inside = *all == Side::inside ? block.split : 0;
          if (*all != Side::inside || values_.refine != Refine::uniform) {
            block.placed.clear();
            continue;
          }
        } else {
          block.above = block.key.at_least(values_.sides.first_above()) & block.split;
          block.inside = block.key.at_least(values_.sides.first_inside()) & block.split & ~block.above;
        }
        if (block.split != 0) found[piece].push_back(std::uint32_t(number));
      }
    });
    for (const auto& some : found) active_.insert(active_.end(), some.begin(), some.end());
  }

  void find_counting() {
    cut_bits_.resize((active_.size() + kPiece - 1) / kPiece);
    cut_bits_of_.resize(state_.blocks.size());
    std::vector<std::int64_t> tets(cut_bits_.size());
    for_each_piece(active_.size(), [&](std::size_t begin, std::size_t end, std::size_t piece) {
      FrontCursor cursor(state_);
      std::size_t splits = 0;
      for (std::size_t i = begin; i < end; ++i) splits += std::size_t(std::popcount(state_.blocks[active_[i]].split));
      std::vector<std::uint32_t>& bits = cut_bits_[piece];
      bits.reserve(splits);
      for (std::size_t i = begin; i < end; ++i) {
        cut_bits_of_[active_[i]] = bits.data() + bits.size();
        tets[piece] += count_in(state_.blocks[active_[i]], cursor, bits);
      }
    });
    for (const std::int64_t some : tets) state_.tet_count += std::uint64_t(some);
  }

  // Shows the diamonds that count, and appends which edges of each are cut. Returns how many tetrahedra their splits
  // add.
  [[nodiscard]] std::int64_t count_in(Block& block, FrontCursor& cursor, std::vector<std::uint32_t>& cut_bits) const {
    cursor.move_to(block.scale, block.position);
    std::int64_t tets = 0;
    for (const Slot slot : set_bits<Slot>(block.split)) {
      const Side side = block.side(slot);
      if (!cursor.gather_sides(slot) || !counts(cursor.context(), side, values_.refine)) continue;
      block.counts |= bit(slot);
      cut_bits.push_back(cursor.context().cut_bits(side));
      tets += cursor.added_tets(split_of(side, cut_bits.back()));
    }
    block.shown = block.counts;
    if (block.shown == 0) block.placed.clear();
    return tets;
  }

  static Split split_of(Side side, std::uint32_t cut_bits) { return {cut_bits | std::uint32_t(side) << Split::kSideBit, 0}; }

  void show_ancestors() {
    std::array<std::vector<Block*>, kMaxLevels + 1> of_scale;
    for (const std::uint32_t number : active_) {
      Block& block = state_.blocks[number];
      if (block.shown != 0) of_scale[std::size_t(block.scale)].push_back(&block);
    }
    std::vector<std::vector<Block*>> reached;  // by piece: supercubes where nothing was shown before
    for (std::vector<Block*>& blocks : of_scale) {
      for (int cls = 2; cls >= 0; --cls) {
        reached.assign((blocks.size() + kPiece - 1) / kPiece, {});
        for_each_piece(blocks.size(), [&](std::size_t begin, std::size_t end, std::size_t piece) {
          Around around(state_);
          for (std::size_t i = begin; i < end; ++i) show_parents(around, *blocks[i], kSlotsOfClass[std::size_t(cls)], reached[piece]);
        });
        for (const auto& some : reached) {
          for (Block* const block : some) of_scale[std::size_t(block->scale)].push_back(block);
        }
      }
      for (const Block* const block : blocks) shown_.push_back(state_.find_number(block->scale, block->position));
    }
    std::sort(shown_.begin(), shown_.end());
  }

  // Many threads may show diamonds of one supercube; those of the class that they read are complete.
  static void show_parents(Around& around, const Block& block, std::uint64_t slots, std::vector<Block*>& reached) {
    const std::uint64_t shown = __atomic_load_n(&block.shown, __ATOMIC_RELAXED) & slots;
    if (shown == 0) return;
    around.move_to(block.scale, block.position);
    for (const Slot slot : set_bits<Slot>(shown)) {
      const Links& links = around.links(slot);
      const int parents = diamond_type(kTypeOfSlot[std::size_t(slot)]).parents;
      for (int k = 0; k < parents; ++k) {
        const auto parent = around.at(links.vertex[links.parent[std::size_t(k)]]);
        if (!parent.supercube->is_split(parent.slot)) continue;
        if ((__atomic_load_n(&parent.supercube->shown, __ATOMIC_RELAXED) >> parent.slot & 1) != 0) continue;
        if (__atomic_fetch_or(&parent.supercube->shown, bit(parent.slot), __ATOMIC_RELAXED) == 0) reached.push_back(parent.supercube);
      }
    }
  }

  // Gives points to all that is shown, numbered within each piece first.
  void place_points() {
    struct Placed {
      PointId points = 0;
      std::uint64_t shown = 0;
      std::int64_t tets = 0;
    };
    std::vector<Placed> placed((shown_.size() + kPiece - 1) / kPiece);
    for_each_piece(shown_.size(), [&](std::size_t begin, std::size_t end, std::size_t piece) {
      FrontCursor cursor(state_);
      for (std::size_t i = begin; i < end; ++i) {
        placed[piece].shown += std::uint64_t(std::popcount(state_.blocks[shown_[i]].shown));
        placed[piece].tets += place_in(shown_[i], cursor, placed[piece].points);
      }
    });
    state_.shown_count = 0;
    std::vector<PointId> base;
    base.reserve(placed.size());
    for (const Placed& piece : placed) {
      base.push_back(PointId(state_.points));
      state_.points += piece.points;
      state_.shown_count += piece.shown;
      state_.tet_count += std::uint64_t(piece.tets);
    }
    for_each_piece(shown_.size(), [&](std::size_t begin, std::size_t end, std::size_t piece) {
      for (std::size_t i = begin; i < end; ++i) state_.blocks[shown_[i]].placed.renumber(base[piece]);
    });
  }

  // points: how many were given before. Returns how many tetrahedra the splits add that do not count.
  [[nodiscard]] std::int64_t place_in(std::uint32_t number, FrontCursor& cursor, PointId& points) const {
    Block& block = state_.blocks[number];
    const std::uint32_t* cut_bits = cut_bits_of_[number];
    block.placed.assign(block.counts | (block.shown & block.inside), [&](std::size_t slot) {
      Split split = split_of(block.side(Slot(slot)), block.is_counting(Slot(slot)) ? *cut_bits++ : 0);
      split.first = points;
      points += split.points();
      return split;
    });
    // What does not count has its vertices and its centre on one side.
    std::int64_t tets = 0;
    const std::uint64_t whole = block.shown & block.inside & ~block.counts;
    if (whole != 0) cursor.move_to(block.scale, block.position);
    for (const Slot slot : set_bits<Slot>(whole)) {
      cursor.gather_one_sided(slot);
      tets += cursor.added_tets(split_of(Side::inside, 0));
    }
    return tets;
  }

  FrontState& state_;
  FrontValues& values_;
  const ParallelFor& parallel_;
  std::vector<std::uint32_t> active_;                 // numbers of the supercubes with diamonds that may count
  std::vector<std::vector<std::uint32_t>> cut_bits_;  // by piece of those: of the diamonds that count
  std::vector<const std::uint32_t*> cut_bits_of_;     // by number of the supercube: where its diamonds' begin
  std::vector<std::uint32_t> shown_;                  // numbers of the supercubes with diamonds that are shown
};

// Hides all splits, and shows those that count from the coarsest scale on until one does not fit.
void show_within(FrontState& state, std::uint64_t max_tets) {
  std::vector<const Block*> blocks;  // coarsest first
  for (Block& block : state.blocks) {
    if (state.is_root_block(block)) continue;
    block.shown = 0;
    state.values.withheld += std::uint64_t(std::popcount(block.counts));
    blocks.push_back(&block);
  }
  std::stable_sort(blocks.begin(), blocks.end(), [](const Block* a, const Block* b) { return a->scale > b->scale; });
  state.shown_count = 0;
  state.tet_count = count_root_tets(state);
  ShownSplits splits(state);
  FrontCursor cursor(state);
  for (const Block* const block : blocks) {
    cursor.move_to(block->scale, block->position);
    for (const Slot slot : set_bits<Slot>(block->counts)) {
      if (block->is_shown(slot)) continue;
      if (!cursor.gather_sides(slot) || !splits.show(cursor, max_tets)) return;
    }
  }
}

}  // namespace

std::optional<Vertex> Front::split_all(std::span<const SlotGroup> groups, const GroupKeys& keys_of, const ParallelFor& parallel) {
  std::vector<Block*> blocks;
  blocks.reserve(groups.size());
  for (const SlotGroup& g : groups) {
    Block& block = state_.obtain_block(scale_of_key(g.key), position_of_key(g.key));
    block.split = g.slots;
    blocks.push_back(&block);
    state_.split_count += std::uint64_t(std::popcount(g.slots));
  }
  std::atomic<bool> failed = false;
  Vertex misfit;
  parallel((groups.size() + kPiece - 1) / kPiece, [&](std::size_t piece) {
    FrontCursor cursor(state_);
    std::array<ValueKey, kSlots> keys{};
    for (std::size_t i = piece * kPiece; i < std::min(groups.size(), (piece + 1) * kPiece); ++i) {
      keys_of(groups[i], keys);
      blocks[i]->key.assign(groups[i].slots, keys, format().last);
      cursor.move_to(groups[i].key);
      std::uint64_t splittable = cursor.may_be_splittable(groups[i].slots);
      if (!cursor.is_interior()) {
        for (const Slot slot : set_bits<Slot>(groups[i].slots)) splittable &= ~(std::uint64_t(!cursor.is_splittable(slot)) << slot);
      }
      const std::uint64_t wrong = groups[i].slots & ~splittable;
      if (wrong != 0 && !failed.exchange(true)) misfit = centre_of(groups[i].key, Slot(std::countr_zero(wrong)));
    }
  });
  if (failed) return misfit;
  parallel((groups.size() + kPiece - 1) / kPiece, [&](std::size_t piece) {
    FrontCursor cursor(state_);
    for (std::size_t i = piece * kPiece; i < std::min(groups.size(), (piece + 1) * kPiece); ++i) {
      cursor.move_to(groups[i].key);
      for (const Slot slot : set_bits<Slot>(groups[i].slots)) {
        if (cursor.gather_keys(slot)) widen_bounds(cursor.key_span(), cursor.centre_key(), *blocks[i]);
      }
    }
  });
  Reclassification(state_, parallel).run();
  return {};
}

void Front::set_range(const Range& range, Refine refine, std::uint64_t max_tets, const ParallelFor& parallel) {
  state_.values = FrontValues(format(), range, refine);
  Reclassification(state_, parallel).run();
  if (state_.tet_count > max_tets && state_.shown_count > 0) show_within(state_, max_tets);
}

}  // namespace intervale
