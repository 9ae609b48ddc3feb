// The current mesh, as a front of diamonds: the unsplit ones with at least one split parent, at first the root. Splits
// refine it and merges coarsen it (Weiss and De Floriani 2008, section 7). It needs no field.
//
// A split brings the value at the diamond's centre, and the front derives sides and cuts from the values, for any
// range. What is shown in the mesh follows one rule: a split is shown if its diamond counts for the range, or a child's
// split is shown. A diamond counts, with Refine::boundary, if its vertices and its centre do not all lie on one side;
// with Refine::uniform, if they are not all below the range and not all above it. Vertices that do not exist do not
// take part.
//
// FrontState holds the data, FrontCursor looks at single diamonds, FrontMesher makes the mesh; Front changes the state
// and keeps its invariants.
//
// A split that counts can also be hidden if no child's split is shown, and those that do not count follow: it is kept,
// and further splits may build on it, but the mesh is made without it, and showing it again costs no more than counting
// its tetrahedra. So a client with a budget keeps more than it draws.
//
// After any sequence of splits, merges, hides and shows the mesh is conforming and positively oriented, and depends
// only on which splits are shown.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/front/front_cursor.h"
#include "common/front/front_state.h"
#include "common/mesh/mesh.h"
#include "common/patch/description.h"
#include "common/patch/value_format.h"
#include "common/util/parallel.h"

namespace intervale {

// A channel for a mesh to bring along.
struct MeshChannel {
  std::string name, unit;
  unsigned components = 1;  // at most kMaxComponents
  // Sets `components` values at a vertex of the hierarchy, not clamped to the box. Called for the vertices of what is
  // shown, from the threads of the mesh's ParallelFor at the same time.
  std::function<void(Vertex vertex, std::span<double> values)> values_at;
};

class Front {
 public:
  // The mesh of the root's patch. grid.dims in [kMinSide, kMaxSide]. format: as check_value_format accepts it. corners:
  // the keys of the root diamond's vertices, in local order. range: alpha <= beta; either may be infinite. Here and
  // below, keys are at most format.last.
  Front(const Grid& grid, const ValueFormat& format, const std::array<ValueKey, kRootVertices>& corners, const Range& range,
        Refine refine = Refine::boundary);

  [[nodiscard]] const ValueFormat& format() const { return state_.values.format; }
  [[nodiscard]] const Range& range() const { return state_.values.range; }
  [[nodiscard]] Refine refine() const { return state_.values.refine; }
  // Splits that count for the range, but are hidden: for want of room, or by hide().
  [[nodiscard]] std::uint64_t withheld_count() const { return state_.values.withheld; }

  // A diamond of the front that can be split now; valid until the next split or merge.
  struct Handle {
    SupercubeKey supercube = 0;
    Slot slot;
    friend bool operator==(const Handle&, const Handle&) = default;
  };

  // The diamond with this centre, if it is in the front with all its tetrahedra, and splitting it would change
  // something. Any vertex is allowed, also one that is no centre.
  [[nodiscard]] std::optional<Handle> find(Vertex centre) const;

  // Splits a diamond by the value at its centre. If the mesh is all that the rule says, it is so again: the split is
  // shown if it counts, and the hidden splits of its ancestors with it. They all stay hidden if the mesh would have
  // more than max_tets tetrahedra, and from then on, as long as splits that count are hidden, new ones stay hidden,
  // too.
  void split(Handle handle, ValueKey key);
  // The same for the diamond that a cursor over state() found last, by find(), gather_keys() or gather_sides(); the
  // cursor sees the split.
  void split(FrontCursor& at, ValueKey key, std::uint64_t max_tets = ~std::uint64_t(0));

  // Undoes the split of a diamond none of whose children is split. False, and nothing done, if there is no such split.
  // Ancestors that do not count and are left without a shown child are hidden.
  bool merge(Vertex centre);

  // Takes a split that is shown out of the mesh, or puts one that is hidden back. Both take ancestors along: hide()
  // hides those that do not count and are left without a shown child, and show() shows all that are hidden. False, and
  // nothing done, if a child's split is shown; if the split to be shown does not count, for it is shown with its
  // descendants only; or if the mesh would have more than max_tets tetrahedra. What was hidden returns with
  // set_range().
  bool hide(Handle handle);
  bool show(Handle handle, std::uint64_t max_tets);

  // Undoes splits and frees their memory: of those named, finest first, each that is split and by then has no split
  // child. Others are ignored. groups: keys strictly ascending. Hides ancestors as merge() does. O(front).
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

  // The mesh, in world coordinates, with the value of each point, and with channels: linear along the edges that are
  // cut, as the values are.
  [[nodiscard]] Mesh mesh(const ParallelFor& parallel = serial, std::span<const MeshChannel> channels = {}) const;

  // Whether both have one grid, format and range, equal keys at the corners, and every diamond split here is split in
  // `other` with the same key. O(front).
  [[nodiscard]] bool is_part_of(const Front& other) const;

  // Merges every diamond whose split is not shown in `coarse`, children first: of two fronts of one stream, the finer
  // one's mesh becomes equal to the coarser one's, if nothing that counts is hidden here. False if some could not be
  // merged, because what `coarse` shows needs them. O(front).
  [[nodiscard]] bool coarsen_to(const Front& coarse);

  // Checks every invariant; returns the first violation. For tests; O(front).
  [[nodiscard]] std::optional<std::string> validate() const;

  // The keys of one supercube: fills keys[slot] for the group's slots, at least. Called from many threads if `parallel`
  // uses them.
  using GroupKeys = std::function<void(const SlotGroup& group, std::span<ValueKey, kSlots> keys)>;

  // Splits many diamonds of a front without splits. groups: keys strictly ascending. Returns the centre of a
  // diamond that cannot be split, because it does not exist, a parent is not split, or its split would change nothing.
  // Shows what the rule says.
  std::optional<Vertex> split_all(std::span<const SlotGroup> groups, const GroupKeys& keys_of, const ParallelFor& parallel = serial);

  // Makes the mesh that of another range, from the values that are there: that of a new front with the same splits. All
  // that was hidden is shown if the rule says so; but if the mesh would have more than max_tets tetrahedra, splits that
  // count are shown from the coarsest scale on, until one does not fit. Points get other numbers. O(front); most of it
  // for what is shown.
  void set_range(const Range& range, Refine refine, std::uint64_t max_tets = ~std::uint64_t(0), const ParallelFor& parallel = serial);

 private:
  FrontState state_;
};

// How many tetrahedra the mesh of fronts[i] may have so that the meshes of all have no more than max_tets.
[[nodiscard]] inline std::uint64_t tets_left(std::span<const Front> fronts, std::size_t i, std::uint64_t max_tets) {
  for (std::size_t other = 0; other < fronts.size(); ++other) {
    if (other != i) max_tets -= std::min(max_tets, fronts[other].tet_count());
  }
  return max_tets;
}

}  // namespace intervale
