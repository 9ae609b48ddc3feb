// Looks at the diamonds of a front, one supercube at a time: what of a diamond exists, and the sides and the keys of
// its vertices.
#pragma once

#include <cstdint>
#include <span>
#include <type_traits>

#include "common/codec/value_prediction.h"
#include "common/diamond/diamond.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/front/diamond_parts.h"
#include "common/front/front_state.h"
#include "common/patch/diamond_context.h"

namespace intervale {

// Finds the blocks of a front. Never null: for a supercube without splits a block without any. State: FrontState, const
// if the blocks are only read.
template <class State>
class BlockFinderOf {
 public:
  static constexpr bool kImmutable = false;
  using Found = std::conditional_t<std::is_const_v<State>, const FrontState::Block*, FrontState::Block*>;
  explicit BlockFinderOf(State& state) : state_(state) {}
  static void move_to(int /*scale*/, Vertex /*position*/) {}
  [[nodiscard]] Found find(int where, const SupercubePlace& place) const;
  [[nodiscard]] static Found none();

 private:
  State& state_;
};
using BlockFinder = BlockFinderOf<const FrontState>;

// Sees the state as it was when the cursor last moved, and splits that Front::split made through this cursor since. One
// thread at a time.
class FrontCursor {
 public:
  using Block = FrontState::Block;
  using Split = FrontState::Split;

  explicit FrontCursor(const FrontState& state) : state_(state), neighbours_(state) {}  // which must outlive it

  void move_to(SupercubeKey supercube) { move_to(scale_of_key(supercube), position_of_key(supercube)); }
  void move_to(int scale, Vertex position);  // position: a diamond's centre >> (scale + 2)
  void move_to(const Diamond& d);            // to its supercube

  // Finds the diamond in a slot if it exists and all its vertices' diamonds are split: if it is split, or in the front
  // with all its tetrahedra. The functions below are of the diamond found last.
  bool gather_sides(Slot slot);
  // Finds the diamond in a slot whose own split is shown. Its vertices' sides follow from its cuts.
  void gather_own(Slot slot);
  // Finds the diamond in a slot whose split is there and does not count: its vertices have its centre's side.
  void gather_one_sided(Slot slot);
  // Like gather_sides(), with the keys of the vertices in place of their sides.
  bool gather_keys(Slot slot);
  // The same, if it can be split now.
  bool find(Slot slot) { return parents_are_split(slot) && gather_keys(slot) && !is_split() && !is_noop(); }

  [[nodiscard]] Diamond diamond() const {
    const unsigned type = kTypeOfSlot[std::size_t(slot_)];
    return {centre_of(scale(), position(), slot_), scale(), type};
  }
  [[nodiscard]] Slot slot() const { return slot_; }
  [[nodiscard]] const DiamondParts& parts() const { return parts_; }
  [[nodiscard]] const Links& links() const { return neighbours_.links(slot_); }
  // The keys at its vertices, kNoKey at one that does not exist; and at the centre of a diamond that is split
  [[nodiscard]] const VertexKeys& vertex_keys() {
    if (!has_keys_) load_keys();
    return keys_;
  }
  // The least and the greatest of those at vertices that exist
  [[nodiscard]] const KeySpan& key_span() {
    if (!has_keys_) load_keys();
    return key_span_;
  }
  [[nodiscard]] ValueKey centre_key() { return here().key[std::size_t(slot_)]; }
  // After gather_keys() and find() its sides may be those of another diamond
  [[nodiscard]] const DiamondContext& context() const { return context_; }
  // The same, with its own sides
  const DiamondContext& context_with_sides();
  [[nodiscard]] bool is_split() { return here().is_split(slot_); }
  [[nodiscard]] bool is_shown() { return here().is_shown(slot_); }
  [[nodiscard]] bool is_noop() const { return parts_.straddles && state_.domain.is_noop(diamond()); }
  // Whether a split of it is possible, or was: all parents that exist are split, and it would change something. The
  // diamond is found if not all its supercube is inside the box.
  [[nodiscard]] bool is_splittable(Slot slot) { return parents_are_split(slot) && (is_interior_ || (gather_sides(slot) && !is_noop())); }
  // Of these slots those that is_splittable() is true of, if the supercube is interior; otherwise all.
  [[nodiscard]] std::uint64_t may_be_splittable(std::uint64_t slots);
  [[nodiscard]] bool parents_are_shown();
  // Whether the diamond handed tetrahedra to a child that is split.
  [[nodiscard]] bool has_split_child();
  // Whether a child's split is shown: one by its place, whether it was handed tetrahedra or not.
  [[nodiscard]] bool has_shown_child();
  // Whether all diamonds of the supercube lie inside the box.
  [[nodiscard]] bool is_interior() const { return is_interior_; }
  // How many tetrahedra the mesh gains by this split of it; less than 0 if it loses some.
  [[nodiscard]] std::int64_t added_tets(const Split& split) const;

  // Of the supercube: its block, and the diamond that a link of one of its slots leads to.
  [[nodiscard]] const Block& here() { return *neighbours_.at(kHere); }
  struct Neighbour {
    const Block& block;
    Slot slot;
    [[nodiscard]] bool is_split() const { return block.is_split(slot); }
    [[nodiscard]] bool is_shown() const { return block.is_shown(slot); }
    [[nodiscard]] Split split() const { return block.split_at(slot); }
  };
  [[nodiscard]] Neighbour at(Link link) {
    const auto found = neighbours_.at(link);
    return {*found.supercube, found.slot};
  }
  [[nodiscard]] const Links& links(Slot slot) const { return neighbours_.links(slot); }
  [[nodiscard]] std::span<const Link> children(Slot slot) const { return neighbours_.children(slot); }
  [[nodiscard]] int scale() const { return neighbours_.scale(); }
  [[nodiscard]] Vertex position() const { return neighbours_.position(); }
  // The block, to be changed: that of `state`, which is the one that the cursor looks at. Adds it if it is not there.
  [[nodiscard]] Block& obtain_here(FrontState& state) {
    if (here_ == FrontState::kNone) {
      here_ = state.obtain_number(scale(), position());
      neighbours_.set_here(&state.blocks[here_]);
    }
    return state.blocks[here_];
  }

 private:
  [[nodiscard]] bool parents_are_split(Slot slot);
  bool gather_parts(Slot slot);
  bool load_keys();

  const FrontState& state_;
  SupercubeNeighbours<BlockFinder> neighbours_;
  std::uint32_t here_ = FrontState::kNone;  // number of the supercube's block
  bool is_interior_ = false;                // all diamonds of the supercube are inside the box
  Slot slot_;
  DiamondParts parts_;
  DiamondContext context_;
  bool has_keys_ = false, has_sides_ = false;
  VertexKeys keys_{};
  KeySpan key_span_;
};

}  // namespace intervale
