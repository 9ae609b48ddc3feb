#include "common/front/corners.h"

#include <cassert>

#include "common/front/diamond_parts.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
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

// The cuts of the root's edges that a corner owns: its split's bits, and q of each cut in order of the bits.
void place_corner(FrontState& state, const RootPatch& root_patch, const DiamondParts& parts, const Diamond& root, int corner) {
  const Links& links = link_table()[0][kSlotOfType[root.type]];
  const auto [block, slot] = corner_at(state, root, corner);
  const Side side = root_patch.side[std::size_t(corner)];
  block->split |= std::uint64_t(1) << slot;
  block->shown = block->counts = block->split;
  block->set_side(slot, side);
  Split s;
  s.bits = std::uint32_t(side) << Split::kSideBit;
  s.first = PointId(state.q.size());
  std::array<Cuts, kMaxVertices> cuts_to{};  // by the other end's local number: not the order of the root's edges
  for (const int e : set_bits(parts.edges)) {
    const Links::Edge edge = links.edge[std::size_t(e)];
    if (edge.owner != corner) continue;
    const auto [a, b] = edge_ends(e, root.row->belt);
    const Side side_a = root_patch.side[std::size_t(a)], side_b = root_patch.side[std::size_t(b)];
    const Cuts& cuts = root_patch.cuts[std::size_t(e)];
    cuts_to[edge.other] = a == corner ? cuts : reversed(cuts);
    const unsigned surfaces = unsigned(alpha_cuts(side_a, side_b)) | unsigned(beta_cuts(side_a, side_b)) << 1;
    s.bits |= surfaces << (2 * edge.other);
  }
  block->placed.set(slot, s);
  for (const Cuts& c : cuts_to) state.q.insert(state.q.end(), c.q, c.q + c.count);
  state.q.push_back(0);
  state.points = PointId(state.q.size());
}

}  // namespace

void place_corners(FrontState& state, const RootPatch& root_patch) {
  const Diamond root(state.domain.root());
  const DiamondParts parts = parts_of(state.domain, root);
  state.obtain_block(state.domain.levels(), {});
  for (int v = 0; v < kRootVertices; ++v) place_corner(state, root_patch, parts, root, v);
  state.tet_count = count_root_tets(state, root_patch);
}

std::uint64_t count_root_tets(const FrontState& state, const RootPatch& root_patch) {
  const Diamond root(state.domain.root());
  std::uint32_t sides = 0;
  for (int v = 0; v < kRootVertices; ++v) sides |= std::uint32_t(root_patch.side[std::size_t(v)]) << (2 * v);
  return count_tets(state.domain, root, parts_of(state.domain, root), sides);
}

void set_corner_keys(FrontState& state, const std::array<ValueKey, kRootVertices>& keys) {
  const Diamond root(state.domain.root());
  state.obtain_block(state.domain.levels(), {});
  for (int v = 0; v < kRootVertices; ++v) {
    const auto [block, slot] = corner_at(state, root, v);
    block->key.set(slot, keys[std::size_t(v)], state.values->format.last);
  }
}

RootPatch root_patch_of(const FrontState& state) {
  const FrontValues& values = *state.values;
  const Diamond root(state.domain.root());
  std::array<ValueKey, kRootVertices> keys{};
  RootPatch root_patch;
  for (int v = 0; v < kRootVertices; ++v) {
    const auto [block, slot] = corner_at(state, root, v);
    keys[std::size_t(v)] = block->key[std::size_t(slot)];
    root_patch.side[std::size_t(v)] = values.sides.side(keys[std::size_t(v)]);
  }
  for (int e = 0; e < kRootEdges; ++e) {
    const auto [a, b] = edge_ends(e, root.row->belt);
    root_patch.cuts[std::size_t(e)] =
        cuts_between(values.format.value(keys[std::size_t(a)]), values.format.value(keys[std::size_t(b)]), values.range);
  }
  return root_patch;
}

}  // namespace intervale
