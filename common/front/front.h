// The mesh that is refined and coarsened, and the front: the unsplit diamonds that the split ones leave. It needs no field.
//
// Weiss and De Floriani 2008, sections 6 and 7. In the paper each diamond of the front holds its vertices and edges, and a split hands each child its
// duet. Here nothing is handed on: what splitting brought (the side of the centre, the cuts on the subdivision edges) is kept with the split diamond,
// supercube by supercube, and a diamond that is looked at gathers its vertices and edges from its ancestors' splits (links.h). A split then writes
// eight bytes and its cuts, a merge clears one bit, and the front is implied. The mesh is made of duets all the same: the halves that split diamonds
// leave to children that are not split.
//
// A split can also be hidden, with all that came after it: it is kept, what is split further is found by it, but the mesh is made without it, and it
// comes back at the cost of counting its tetrahedra. So a client with a budget keeps more than it draws.
//
// After any sequence of splits, merges, hides and shows the mesh is conforming and positively oriented, and depends only on which splits are shown.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/codec/prediction.h"
#include "common/codec/root_patch.h"
#include "common/diamond/diamond.h"
#include "common/diamond/domain.h"
#include "common/diamond/grid.h"
#include "common/diamond/links.h"
#include "common/diamond/supercube.h"
#include "common/mesh/mesh.h"
#include "common/util/parallel.h"

namespace intervale {

class Front {
 public:
  // The mesh of the root's patch. grid.dims in [kMinSide, kMaxSide].
  Front(const Grid& grid, const Base& base);

  // A diamond of the front that can be split now; valid until the next split or merge.
  struct Handle {
    SupercubeKey supercube = 0;
    int slot = 0;
    friend bool operator==(const Handle&, const Handle&) = default;
  };

  // The diamond with this centre, if it is in the front with all its tetrahedra, is not split and not idle. Any vertex will do, also one that is no
  // centre.
  [[nodiscard]] std::optional<Handle> find(Vertex centre) const;

  // What the diamond knows before its split. Its count_cuts tells how many coefficients splitting takes.
  [[nodiscard]] DiamondContext context(Handle handle) const;

  // Splits a diamond, and shows that if all splits so far are shown. cuts: q (see Cuts) of each cut on the subdivision edges, centre to vertex, in
  // order of local vertices, alpha before beta: context(handle).count_cuts(side).all of them.
  void split(Handle handle, Side side, std::span<const std::uint8_t> cuts);

  // Undoes the split of a diamond none of whose children is split. False, and nothing done, if there is no such.
  bool merge(Vertex centre);

  // Takes a split that is shown out of the mesh, or puts one that is hidden back. False, and nothing done, if a child's split is shown, or a parent's
  // hidden; or if the mesh would have more than max_tets tetrahedra.
  bool hide(Handle handle);
  bool show(Handle handle, std::uint64_t max_tets);

  // Undoes splits and gives their room back: of those named, finest first, each that is split and by then has no child that is. groups: keys strictly
  // ascending. What is not split counts for nothing. O(front).
  void forget(std::span<const SlotGroup> groups);

  [[nodiscard]] std::uint64_t tet_count() const { return tet_count_; }      // of the mesh
  [[nodiscard]] std::uint64_t split_count() const { return split_count_; }  // diamonds that are split, hidden ones too
  [[nodiscard]] std::uint64_t shown_count() const { return shown_count_; }  // of those, the mesh's
  [[nodiscard]] std::size_t memory_bytes() const;
  [[nodiscard]] std::uint64_t renamed() const { return renamed_; }  // how often the names of points changed; see FrontPatches

  // The diamonds that are split, hidden ones too, by supercube, keys ascending; only keys and slots mean something.
  [[nodiscard]] std::vector<SlotGroup> splits() const;
  [[nodiscard]] std::uint64_t shown_slots(SupercubeKey supercube) const;  // of that one's splits
  [[nodiscard]] bool is_hidden(Handle handle) const;                      // split, but not shown

  // The mesh, in world coordinates.
  [[nodiscard]] Mesh mesh(const ParallelFor& parallel = serial) const;

  // Whether both are of one grid and base, and every diamond split here is split in `other` with the same side and cuts. The mesh depends on nothing
  // else. O(front).
  [[nodiscard]] bool is_part_of(const Front& other) const;

  // Merges every diamond whose split is not shown in `coarse`, children first: of two fronts of one stream, the finer one's mesh becomes equal to the
  // coarser one's. False if some could not be merged, because what `coarse` shows needs them. O(front).
  [[nodiscard]] bool coarsen_to(const Front& coarse);

  // Every invariant that can be checked from inside; the first one that does not hold, as a text. For tests; O(front).
  [[nodiscard]] std::optional<std::string> validate() const;

  // Looks at the diamonds of one supercube at a time, and splits them. Sees splits made by itself only, until it moves.
  class Cursor;

  // Splits many diamonds of a front that has none split yet: groups of `set`, keys strictly ascending, together closed under parents.
  // cut_count(UpdateIndex): how many cuts the update brings; decode(Place, DiamondContext, q) writes as many and returns the side, or nothing if they
  // do not fit. Both are called from many threads if `parallel` uses them. Returns the centre of an update that did not fit, and the front is then of
  // no more use.
  template <class CutCount, class Decode>
  std::optional<Vertex> split_all(const SupercubeSet& set, std::span<const SlotGroup> groups, const CutCount& cut_count, const Decode& decode,
                                  const ParallelFor& parallel = serial, const OnProgress& progress = {});

 private:
  friend class FrontPatches;

  // A split, as bits: 2 v for a cut of alpha on the edge from the centre to local vertex v, 2 v + 1 for one of beta; above them the centre's side.
  static constexpr int kSideBit = 2 * kMaxVertices;
  static constexpr std::uint32_t kCutBits = (1u << kSideBit) - 1;
  struct Split {
    std::uint32_t bits = 0;
    std::uint32_t first = 0;  // in q_: its cuts in order of their bits. So are mesh points named; the centre comes after the last cut.
    [[nodiscard]] Side side() const { return Side(bits >> kSideBit); }
    [[nodiscard]] std::uint32_t cut(int bit) const { return first + std::uint32_t(std::popcount(bits & ((1u << bit) - 1))); }
    [[nodiscard]] std::uint32_t centre() const { return first + std::uint32_t(std::popcount(bits & kCutBits)); }
  };
  // All that is known in one supercube.
  struct Block {
    Vertex position;  // centre >> (scale + 2)
    std::int32_t scale = 0;
    std::uint64_t split = 0;  // slots
    std::uint64_t shown = 0;  // of those
    std::array<Split, kSlots> of{};
    // Numbers of the supercubes around it that were looked for and found, and 1; by where (links.h). Kept by whoever looks, on any thread.
    mutable std::array<std::uint32_t, kCorner> near{};
  };
  // What of a diamond exists: bits by local number.
  struct Existing {
    std::uint32_t tets = 0, vertices = 0, edges = 0;
    bool straddles = false;  // clamping moves some of it
  };

  static constexpr std::uint32_t kNone = std::uint32_t(-1);
  [[nodiscard]] std::uint32_t find_number(int scale, Vertex position) const;  // of a supercube; kNone if it is not there
  [[nodiscard]] const Block* find_block(int scale, Vertex position) const {
    const std::uint32_t number = find_number(scale, position);
    return number == kNone ? nullptr : &blocks_[number];
  }
  Block& obtain_block(int scale, Vertex position);
  [[nodiscard]] std::span<const std::uint8_t> cuts_of(const Split& split) const {
    return std::span(q_).subspan(split.first, split.centre() - split.first);
  }
  void pack();
  [[nodiscard]] bool has_splits_of(const Block& block, const Front& owner) const;
  // Whether a diamond handed tetrahedra to a child with one of these.
  [[nodiscard]] bool has_children_among(const Diamond& d, const Existing& e, std::uint64_t Block::*slots) const;
  [[nodiscard]] Existing existing(const Diamond& d) const;
  [[nodiscard]] bool is_border(Vertex v) const;
  [[nodiscard]] std::uint64_t count_tets(const Diamond& d, const Existing& e, std::uint32_t sides) const;
  [[nodiscard]] std::uint64_t count_halves(const Diamond& d, const Existing& e, std::uint32_t sides) const;
  [[nodiscard]] TetShape shape(const Diamond& d, const Existing& e, int tet) const;
  [[nodiscard]] TetShape half_shape(const Diamond& d, const Existing& e, int tet, int end) const;
  [[nodiscard]] bool half_exists(const Diamond& d, int tet, int end) const;

  Grid grid_;
  Domain domain_;
  std::deque<Block> blocks_;                                       // stay where they are
  boost::unordered_flat_map<std::uint64_t, std::uint32_t> index_;  // of blocks, by scale and position
  Block corner_;                                                   // vertex (0, 0, 0): slot 0
  std::vector<std::uint8_t> q_;                                    // of every cut; one more for a centre inside
  std::uint64_t tet_count_ = 0, split_count_ = 0, shown_count_ = 0, renamed_ = 0;
};

class Front::Cursor {
 public:
  explicit Cursor(Front& front) : front_(front) {}
  // Of a front that is not to be changed: split() must not be called.
  explicit Cursor(const Front& front) : front_(const_cast<Front&>(front)) {}

  void move_to(SupercubeKey supercube) { move_to(scale_of_key(supercube), position_of_key(supercube)); }
  void move_to(int scale, Vertex position);  // position: a diamond's centre >> (scale + 2)

  // Finds a diamond that has tetrahedra and was or is in the mesh with all of them. False if there is none in this slot.
  bool gather(int slot);
  // ... that can be split now.
  bool find(int slot) { return parents_are_split(slot) && gather(slot) && !is_split() && !is_idle(); }

  // Of the diamond found last.
  [[nodiscard]] const Diamond& diamond() const { return *diamond_; }
  [[nodiscard]] const DiamondContext& context() const { return context_; }  // but for its cuts, which are those of any diamond
  const DiamondContext& look_closer();                                      // with its cuts
  [[nodiscard]] bool is_split() { return (split_slots() >> slot_ & 1) != 0; }
  [[nodiscard]] bool is_shown() { return (at({kHere, 0}).block->shown >> slot_ & 1) != 0; }

  [[nodiscard]] std::uint64_t split_slots();  // of this supercube

  // Splits the diamond found last, after a closer look. As Front::split; but hidden if the mesh would have more than max_tets tetrahedra.
  void split(Side side, std::span<const std::uint8_t> cuts, std::uint64_t max_tets = ~std::uint64_t(0));

 private:
  friend class Front;
  friend class FrontPatches;
  struct Found {
    const Block* block;
    int slot;
  };
  const Block* resolve(std::uint8_t where);
  [[nodiscard]] bool parents_are_split(int slot);
  [[nodiscard]] Found at(Link link) {
    const Block* block = near_[link.where];
    if (block == nullptr) block = resolve(link.where);
    return {block, link.slot | corner_slot_[link.where]};
  }
  [[nodiscard]] bool is_idle() const { return existing_.straddles && front_.domain_.is_idle(*diamond_); }
  void write(Block& block, Side side, std::span<const std::uint8_t> cuts, std::uint32_t first);
  [[nodiscard]] std::int64_t added_tets(const Split& split) const;  // by showing the split of the diamond found last
  [[nodiscard]] bool parents_are_shown();                           // of the diamond found last

  Front& front_;
  int scale_ = 0, slot_ = 0;
  Vertex position_;
  bool interior_ = false;  // all diamonds of this supercube are inside the box
  const std::array<Links, kSlots>* links_ = nullptr;
  std::array<const Block*, kWheres> near_{};         // null: not looked for yet
  std::array<std::uint8_t, kWheres> corner_slot_{};  // of a corner's vertex; 0 elsewhere
  std::optional<Diamond> diamond_;
  Existing existing_;
  std::array<Split, kMaxVertices> split_;  // of each vertex
  DiamondContext context_;
};

template <class CutCount, class Decode>
std::optional<Vertex> Front::split_all(const SupercubeSet& set, std::span<const SlotGroup> groups, const CutCount& cut_count, const Decode& decode,
                                       const ParallelFor& parallel, const OnProgress& progress) {
  // First room for all, then pass by pass, parents before children: within a pass no diamond is another's ancestor.
  std::vector<Block*> blocks;
  blocks.reserve(groups.size());
  std::size_t size = q_.size();
  for (const SlotGroup& g : groups) {
    Block* const block = &obtain_block(scale_of_key(g.key), position_of_key(g.key));
    blocks.push_back(block);
    UpdateIndex i = set.first(g.brick, g.supercube);
    for (std::uint64_t left = set.occupancy()[g.supercube]; left != 0; left &= left - 1, ++i) {
      const int slot = std::countr_zero(left);
      if (!(g.slots >> slot & 1)) continue;
      block->of[slot].first = std::uint32_t(size);
      size += cut_count(i) + 1;
    }
    // Said before it is so: whoever looks has come to a later pass than its ancestors.
    block->split = block->shown = g.slots;
    split_count_ += std::uint64_t(std::popcount(g.slots));
    shown_count_ += std::uint64_t(std::popcount(g.slots));
  }
  q_.resize(size);
  constexpr std::size_t kPiece = 32, kPiecesBetweenProgress = 512;  // in supercubes; in pieces
  std::atomic<std::int64_t> added = 0;
  std::atomic<std::uint64_t> done = 0;
  std::uint64_t all = 0;
  for (const SlotGroup& g : groups) all += std::uint64_t(std::popcount(g.slots));
  std::atomic<bool> failed = false;
  Vertex wrong;
  for (std::size_t first = 0, last = 0; first < groups.size(); first = last) {
    const int scale = scale_of_key(groups[first].key);
    while (last < groups.size() && scale_of_key(groups[last].key) == scale) ++last;
    for (const std::uint64_t cls : kSlotsOfClass) {
      const auto split_piece = [&](std::size_t piece) {
        Cursor cursor(*this);
        std::int64_t sum = 0;
        std::uint64_t splits = 0;
        std::array<std::uint8_t, kMaxCuts> q;
        const std::size_t end = std::min(last, first + (piece + 1) * kPiece);
        for (std::size_t k = first + piece * kPiece; k < end; ++k) {
          const SlotGroup& g = groups[k];
          const std::uint64_t chosen = g.slots & cls;
          if (chosen == 0) continue;
          cursor.move_to(scale, blocks[k]->position);
          splits += std::uint64_t(std::popcount(chosen));
          for (std::uint64_t left = chosen; left != 0; left &= left - 1) {
            const int slot = std::countr_zero(left);
            const Place place = set.place_in(g.brick, g.supercube, g.key, slot);
            const auto n = std::size_t(cut_count(place.index));
            const bool fits = cursor.gather(slot) && !cursor.is_idle();
            const std::optional<Side> side = fits ? decode(place, cursor.look_closer(), q.data()) : std::nullopt;
            if (!side || std::size_t(cursor.context().count_cuts(*side).all) != n) {
              if (!failed.exchange(true)) wrong = centre_of(g.key, slot);
              return;
            }
            cursor.write(*blocks[k], *side, std::span(q).first(n), blocks[k]->of[slot].first);
            sum += cursor.added_tets(blocks[k]->of[slot]);
          }
        }
        added += sum;
        done += splits;
      };
      const std::size_t pieces = (last - first + kPiece - 1) / kPiece;
      for (std::size_t piece = 0; piece < pieces && !failed; piece += kPiecesBetweenProgress) {
        parallel(std::min(kPiecesBetweenProgress, pieces - piece), [&](std::size_t i) { split_piece(piece + i); });
        if (progress) progress(double(done.load()) / double(all));
      }
      if (failed) return wrong;
    }
  }
  tet_count_ += std::uint64_t(added.load());
  return {};
}

}  // namespace intervale
