// The data of a front: the split diamonds by supercube, their values or cuts, and counts.
//
// Weiss and De Floriani 2008, sections 6 and 7. In the paper each diamond of the front holds its vertices and edges,
// and a split hands each child its duet. Here what a split brought (the side of the centre, the cuts on the subdivision
// edges) stays with the split diamond, supercube by supercube, and a diamond gathers its vertices and edges from its
// ancestors' splits (supercube_neighbours.h). A split then writes some bytes, a merge clears one bit, and the front
// itself is implied.
//
// A front is split by cuts or by values. One that is split by values has FrontState::values. It keeps the key of the
// value at each split diamond's centre, and derives sides from the keys; where its cuts are it derives when they are
// asked for. Only shown splits have points, so that a front may hold far more than it shows.
//
// Invariants, which Front keeps and Front::validate checks:
//   1. Of each split diamond, all parents that exist are split; of each shown one, all are shown. shown is a subset of
//      split.
//   2. A split, or by values a shown split, has the cuts that its side and its diamond's vertices call for.
//   3. index has the number of each block under its scale and position, and no other. A block stays where it is until
//      pack().
//   4. The counters are those of the splits and of the mesh that the shown ones make.
//   5. Split by values: what is shown and does not count for the range has a child whose split is shown. If no split
//      that counts is hidden and the mesh is not limited, every split with a shown child is shown. A child is one by
//      its place, whether it was handed tetrahedra or not.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/diamond/domain.h"
#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/front/block_index.h"
#include "common/front/front_block.h"
#include "common/patch/description.h"
#include "common/patch/key_sides.h"
#include "common/patch/range.h"
#include "common/patch/value_format.h"

namespace intervale {

// What the values of a front mean, and the range that its mesh is made for.
struct FrontValues {
  FrontValues(const ValueFormat& of, const Range& kept, Refine how) : format(of), range(kept), refine(how), sides(of, kept) {}
  ValueFormat format;
  Range range;
  Refine refine;
  KeySides sides;              // of format and range
  std::uint64_t withheld = 0;  // split diamonds that count for the range, but are hidden
  bool is_limited = false;     // a split that has a shown child was hidden, for want of room
  // Whether the mesh is all that the rule says (Front).
  [[nodiscard]] bool is_complete() const { return withheld == 0 && !is_limited; }
};

struct FrontState {
  using Block = FrontBlock;
  using Split = FrontSplit;
  static constexpr std::uint32_t kNone = BlockIndex::kNone;

  explicit FrontState(const Grid& of) : grid(of), domain(of.dims) {}

  // The number of a supercube's block, or kNone.
  [[nodiscard]] std::uint32_t find_number(int scale, Vertex position) const { return index.find(scale, position); }
  // Or null.
  [[nodiscard]] const Block* find_block(int scale, Vertex position) const {
    const std::uint32_t number = find_number(scale, position);
    return number == kNone ? nullptr : &blocks[number];
  }
  // Adds the supercube's block if it is not there.
  Block& obtain_block(int scale, Vertex position) { return blocks[obtain_number(scale, position)]; }
  std::uint32_t obtain_number(int scale, Vertex position);
  [[nodiscard]] std::span<const std::uint8_t> cuts_of(const Split& split) const {
    return std::span(q).subspan(split.first, split.centre() - split.first);
  }
  [[nodiscard]] bool is_root_block(const Block& block) const { return block.scale == domain.levels(); }
  [[nodiscard]] std::size_t memory_bytes() const;
  // Removes blocks without splits and cuts that belong to no split, or by values to none that is shown. Blocks move,
  // and points get other numbers.
  void pack();

  Grid grid;
  Domain domain;
  std::optional<FrontValues> values;  // of a front split by values
  // The first has the domain's corners but (0, 0, 0), as diamonds of scale `levels`
  std::deque<Block> blocks;
  BlockIndex index;    // of blocks
  Block origin;        // the domain's corner (0, 0, 0): slot 0
  PointId points = 0;  // PointIds that were given
  // By PointId, of each cut its q (see Cuts); unused for a centre. By values, only of the points of the domain's
  // corners, which come first: the others' follow from the keys.
  std::vector<std::uint8_t> q;
  std::uint64_t tet_count = 0, split_count = 0, shown_count = 0;
  std::uint64_t point_generation = 0;  // how often points got other numbers
};

}  // namespace intervale
