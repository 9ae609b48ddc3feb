// The current mesh, as a front of diamonds: the unsplit ones with at least one split parent, at first the root. Splits
// refine it and merges coarsen it (Weiss and De Floriani 2008, section 7). It needs no field.
//
// FrontState holds the data, FrontCursor looks at single diamonds, FrontMesher makes the mesh; Front changes the state
// and keeps its invariants.
//
// A split can also be hidden, with all splits that depend on it: it is kept, and further splits may build on it, but
// the mesh is made without it, and showing it again costs no more than counting its tetrahedra. So a client with a
// budget keeps more than it draws.
//
// After any sequence of splits, merges, hides and shows the mesh is conforming and positively oriented, and depends
// only on which splits are shown.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/codec/prediction.h"
#include "common/codec/root_patch.h"
#include "common/codec/update.h"
#include "common/diamond/diamond.h"
#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/front/front_cursor.h"
#include "common/front/front_state.h"
#include "common/mesh/mesh.h"
#include "common/util/parallel.h"

namespace intervale {

class Front {
 public:
  // The mesh of the root's patch. grid.dims in [kMinSide, kMaxSide].
  Front(const Grid& grid, const RootPatch& root_patch);

  // A diamond of the front that can be split now; valid until the next split or merge.
  struct Handle {
    SupercubeKey supercube = 0;
    Slot slot;
    friend bool operator==(const Handle&, const Handle&) = default;
  };

  // The diamond with this centre, if it is in the front with all its tetrahedra, and splitting it would change
  // something. Any vertex is allowed, also one that is no centre.
  [[nodiscard]] std::optional<Handle> find(Vertex centre) const;

  // What the diamond knows before its split. Its count_cuts tells how many cuts splitting takes.
  [[nodiscard]] DiamondContext context(Handle handle) const;

  // Splits a diamond, and shows the split if all splits so far are shown. cuts: q (see Cuts) of each cut on the
  // subdivision edges, centre to vertex, in order of local vertices, alpha before beta:
  // context(handle).count_cuts(side).all of them.
  void split(Handle handle, Side side, std::span<const std::uint8_t> cuts);
  // The same for the diamond that a cursor over state() found last, after gather_cuts(); the cursor sees the split. The
  // split stays hidden if the mesh would have more than max_tets tetrahedra.
  void split(FrontCursor& at, Side side, std::span<const std::uint8_t> cuts, std::uint64_t max_tets = ~std::uint64_t(0));

  // Undoes the split of a diamond none of whose children is split. False, and nothing done, if there is no such split.
  bool merge(Vertex centre);

  // Takes a split that is shown out of the mesh, or puts one that is hidden back. False, and nothing done, if a child's
  // split is shown, or a parent's hidden; or if the mesh would have more than max_tets tetrahedra.
  bool hide(Handle handle);
  bool show(Handle handle, std::uint64_t max_tets);

  // Undoes splits and frees their memory: of those named, finest first, each that is split and by then has no split
  // child. Others are ignored. groups: keys strictly ascending. O(front).
  void forget(std::span<const SlotGroup> groups);

  [[nodiscard]] const FrontState& state() const { return state_; }
  [[nodiscard]] std::uint64_t tet_count() const { return state_.tet_count; }  // of the mesh
  // Diamonds that are split, hidden ones too
  [[nodiscard]] std::uint64_t split_count() const { return state_.split_count; }
  [[nodiscard]] std::uint64_t shown_count() const { return state_.shown_count; }  // of those, the mesh's
  [[nodiscard]] std::size_t memory_bytes() const { return state_.memory_bytes(); }

  // The diamonds that are split, hidden ones too, by supercube, keys ascending; only keys and slots mean something.
  [[nodiscard]] std::vector<SlotGroup> splits() const;
  [[nodiscard]] std::uint64_t shown_slots(SupercubeKey supercube) const;  // of that one's splits
  [[nodiscard]] bool is_hidden(Handle handle) const;                      // split, but not shown

  // The mesh, in world coordinates.
  [[nodiscard]] Mesh mesh(const ParallelFor& parallel = serial) const;

  // Whether both have one grid and root patch, and every diamond split here is split in `other` with the same side and
  // cuts. The mesh depends on nothing else. O(front).
  [[nodiscard]] bool is_part_of(const Front& other) const;

  // Merges every diamond whose split is not shown in `coarse`, children first: of two fronts of one stream, the finer
  // one's mesh becomes equal to the coarser one's. False if some could not be merged, because what `coarse` shows needs
  // them. O(front).
  [[nodiscard]] bool coarsen_to(const Front& coarse);

  // Checks every invariant; returns the first violation. For tests; O(front).
  [[nodiscard]] std::optional<std::string> validate() const;

  // The updates of one supercube: fills updates[slot] for the group's slots, at least. Called from many threads if
  // `parallel` uses them.
  using GroupUpdates = std::function<void(const SlotGroup& group, std::span<UpdateView, kSlots> updates)>;

  // Splits many diamonds of a front without splits. groups: keys strictly ascending; together closed under parents.
  // Returns the centre of an update that does not fit its diamond, and the front must then not be used any more.
  std::optional<Vertex> split_all(std::span<const SlotGroup> groups, const GroupUpdates& updates_of, const ParallelFor& parallel = serial,
                                  const OnProgress& progress = {});

 private:
  void hide(FrontCursor& at);
  FrontState state_;
};

}  // namespace intervale
