// The data of a front: the split diamonds by supercube, their values, and counts.
//
// Weiss and De Floriani 2008, sections 6 and 7. In the paper each diamond of the front holds its vertices and edges,
// and a split hands each child its duet. Here what a split brought stays with the split diamond, supercube by
// supercube, and a diamond gathers its vertices and edges from its ancestors' splits (supercube_neighbours.h). A split
// then writes some bytes, a merge clears one bit, and the front itself is implied.
//
// A split brings the key of the value at the diamond's centre. The side of the centre follows from it, and which edges
// are cut from the sides; where the cuts are is computed from the keys when it is asked for. Only shown splits have
// points, so that a front may hold far more than it shows.
//
// Invariants, which Front keeps and Front::validate checks:
//   1. Of each split diamond, all parents that exist are split; of each shown one, all are shown. shown is a subset of
//      split.
//   2. A shown split has the cuts that its side and its diamond's vertices call for.
//   3. index has the number of each block under its scale and position, and no other. A block stays where it is until
//      pack().
//   4. The counters are those of the splits and of the mesh that the shown ones make.
//   5. What is shown and does not count for the range has a child whose split is shown. If no split that counts is
//      hidden and the mesh is not limited, every split with a shown child is shown. A child is one by its place,
//      whether it was handed tetrahedra or not.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

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

  FrontState(const Grid& of, const FrontValues& with) : grid(of), domain(of.dims), values(with) {}

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
  [[nodiscard]] bool is_root_block(const Block& block) const { return block.scale == domain.levels(); }
  [[nodiscard]] std::size_t memory_bytes() const;
  // Removes blocks without splits, and points that belong to no shown split. Blocks move, and points get other numbers.
  void pack();

  Grid grid;
  Domain domain;
  FrontValues values;
  // The first has the domain's corners but (0, 0, 0), as diamonds of scale `levels`
  std::deque<Block> blocks;
  BlockIndex index;        // of blocks
  Block origin;            // the domain's corner (0, 0, 0): slot 0
  std::size_t points = 0;  // PointIds that were given; beyond kMostPoints they begin anew, and there is no mesh
  std::uint64_t tet_count = 0, split_count = 0, shown_count = 0;
  std::uint64_t point_generation = 0;  // how often points got other numbers
};

}  // namespace intervale
