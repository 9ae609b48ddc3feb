#include "common/front/corners.h"

#include <cassert>

#include "common/front/diamond_parts.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Split = FrontState::Split;

// Where a corner is kept. state: FrontState, const or not.
template <class State>
auto corner_at(State& state, const Diamond& root, int corner) {
  struct Place {
    decltype(&state.origin) block;
    Slot slot;
  };
  const Vertex at = root.vertex(corner);
  if ((at.x | at.y | at.z) == 0) return Place{&state.origin, Slot()};
  const Link link = link_table()[0][kSlotOfType[root.type]].vertex[std::size_t(corner)];
  assert(link.where == kCoarser && "the other corners are in the supercube at (0, 0, 0)");
  return Place{&state.blocks.front(), link.slot};
}

using CornerSides = std::array<Side, kRootVertices>;
CornerSides corner_sides(const FrontState& state, const Diamond& root) {
  CornerSides sides{};
  for (int v = 0; v < kRootVertices; ++v) {
    const auto [block, slot] = corner_at(state, root, v);
    sides[std::size_t(v)] = state.values.sides.side(block->key[std::size_t(slot)]);
  }
  return sides;
}

// The cuts of the root's edges that a corner owns.
void place_corner(FrontState& state, const CornerSides& sides, const DiamondParts& parts, const Diamond& root, int corner) {
  const Links& links = link_table()[0][kSlotOfType[root.type]];
  const auto [block, slot] = corner_at(state, root, corner);
  const Side side = sides[std::size_t(corner)];
  block->split |= std::uint64_t(1) << slot;
  block->shown = block->counts = block->split;
  block->set_side(slot, side);
  Split split{std::uint32_t(side) << Split::kSideBit, PointId(state.points)};
  for (const int e : set_bits(parts.edges)) {
    const Links::Edge edge = links.edge[std::size_t(e)];
    if (edge.owner != corner) continue;
    const auto [a, b] = edge_ends(e, root.row->belt);
    const Side other = sides[std::size_t(a == corner ? b : a)];
    const unsigned surfaces = unsigned(alpha_cuts(side, other)) | unsigned(beta_cuts(side, other)) << 1;
    split.bits |= surfaces << (2 * edge.other);
  }
  block->place(slot, split);
  state.points += split.points();
}

}  // namespace

void set_corner_keys(FrontState& state, const std::array<ValueKey, kRootVertices>& keys) {
  const Diamond root(state.domain.root());
  state.obtain_block(state.domain.levels(), {});
  for (int v = 0; v < kRootVertices; ++v) {
    const auto [block, slot] = corner_at(state, root, v);
    block->key.set(slot, keys[std::size_t(v)], state.values.format.last);
  }
}

void place_corners(FrontState& state) {
  const Diamond root(state.domain.root());
  const DiamondParts parts = parts_of(state.domain, root);
  const CornerSides sides = corner_sides(state, root);
  state.points = 0;
  for (int v = 0; v < kRootVertices; ++v) place_corner(state, sides, parts, root, v);
  state.tet_count = count_root_tets(state);
}

std::uint64_t count_root_tets(const FrontState& state) {
  const Diamond root(state.domain.root());
  std::uint32_t sides = 0;
  int v = 0;
  for (const Side side : corner_sides(state, root)) sides |= std::uint32_t(side) << (2 * v++);
  return count_tets(state.domain, root, parts_of(state.domain, root), sides);
}

}  // namespace intervale
