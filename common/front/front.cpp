#include "common/front/front.h"

#include <algorithm>
#include <cassert>

#include "common/diamond/supercube_neighbours.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;

constexpr std::uint64_t bit(Slot slot) { return std::uint64_t(1) << slot; }

// The cuts of the root's edges that a corner of the domain owns: its split's bits, and q of each cut in order of the
// bits.
void add_corner(FrontState& state, const RootPatch& root_patch, const DiamondParts& parts, const Diamond& root, int corner) {
  const Links& links = link_table()[0][kSlotOfType[root.type]];
  const Vertex at = root.vertex(corner);
  const bool is_origin = (at.x | at.y | at.z) == 0;
  const Slot slot = is_origin ? Slot() : links.vertex[corner].slot;
  assert((is_origin || links.vertex[corner].where == kCoarser) && "the other corners are in the supercube at (0, 0, 0)");
  Block& block = is_origin ? state.origin : state.blocks.front();
  block.split |= bit(slot);
  block.shown = block.split;
  Split& s = block.of[slot];
  s.bits = std::uint32_t(root_patch.side[corner]) << FrontState::kSideBit;
  s.first = PointId(state.q.size());
  std::array<Cuts, kMaxVertices> cuts_to{};  // by the other end's local number: not the order of the root's edges
  for (const int e : set_bits(parts.edges)) {
    const Links::Edge edge = links.edge[e];
    if (edge.owner != corner) continue;
    const auto [a, b] = edge_ends(e, root.row->belt);
    cuts_to[edge.other] = a == corner ? root_patch.cuts[e] : reversed(root_patch.cuts[e]);
    const unsigned surfaces =
        unsigned(alpha_cuts(root_patch.side[a], root_patch.side[b])) | unsigned(beta_cuts(root_patch.side[a], root_patch.side[b])) << 1;
    s.bits |= surfaces << (2 * edge.other);
  }
  for (const Cuts& c : cuts_to) state.q.insert(state.q.end(), c.q, c.q + c.count);
  state.q.push_back(0);
}

}  // namespace

// The corners of the domain are no diamonds, but seven of them have the offsets of diamonds of scale N whose centres
// lie there, and the root's edges are those diamonds' subdivision edges. So the root patch is one more supercube.
Front::Front(const Grid& grid, const RootPatch& root_patch) : state_(grid) {
  const Diamond root(state_.domain.root());
  const DiamondParts parts = parts_of(state_.domain, root);
  state_.obtain_block(state_.domain.levels(), {});
  std::uint32_t sides = 0;
  for (int v = 0; v < kRootVertices; ++v) {
    add_corner(state_, root_patch, parts, root, v);
    sides |= std::uint32_t(root_patch.side[v]) << (2 * v);
  }
  state_.tet_count = count_tets(state_.domain, root, parts, sides);
}

std::optional<Front::Handle> Front::find(Vertex centre) const {
  if ((centre.x | centre.y | centre.z) <= 0 || scale_of(centre) >= state_.domain.levels()) return {};
  const std::int32_t most = 1 << state_.domain.levels();
  if (centre.x > most || centre.y > most || centre.z > most) return {};
  const Diamond d(centre);
  FrontCursor cursor(state_);
  cursor.move_to(d);
  const Slot slot = kSlotOfType[d.type];
  if (!cursor.find(slot)) return {};
  return Handle{supercube_key(d.scale, cursor.position()), slot};
}

DiamondContext Front::context(Handle handle) const {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  cursor.gather(handle.slot);
  return cursor.gather_cuts();
}

void Front::split(Handle handle, Side side, std::span<const std::uint8_t> cuts) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  cursor.gather(handle.slot);
  split(cursor, side, cuts);
}

void Front::split(FrontCursor& at, Side side, std::span<const std::uint8_t> cuts, std::uint64_t max_tets) {
  assert(int(cuts.size()) == at.context().count_cuts(side).all && "the caller counted");
  Block& block = state_.obtain_block(at.scale(), at.position());
  at.set_here(block);
  Split& s = block.of[at.slot()];
  const std::uint32_t bits = at.context().cut_bits(side) | std::uint32_t(side) << FrontState::kSideBit;
  if (s.bits != bits || bits == 0) {  // else the split that was merged comes back, and its points are still there
    s = {bits, PointId(state_.q.size())};
    state_.q.resize(state_.q.size() + s.points());
  }
  std::copy(cuts.begin(), cuts.end(), state_.q.begin() + s.first);
  const bool all_shown = state_.shown_count == state_.split_count;
  block.split |= bit(at.slot());
  ++state_.split_count;
  if (!all_shown) return;
  const std::uint64_t tets = state_.tet_count + std::uint64_t(at.added_tets(s));
  if (tets > max_tets) return;
  state_.tet_count = tets;
  block.shown |= bit(at.slot());
  ++state_.shown_count;
}

bool Front::merge(Vertex centre) {
  if ((centre.x | centre.y | centre.z) <= 0 || scale_of(centre) >= state_.domain.levels()) return false;
  const Diamond d(centre);
  FrontCursor cursor(state_);
  cursor.move_to(d);
  if (!cursor.gather(kSlotOfType[d.type]) || !cursor.is_split() || cursor.has_child_in(&Block::split)) return false;
  if (cursor.is_shown()) hide(cursor);
  state_.obtain_block(cursor.scale(), cursor.position()).split &= ~bit(cursor.slot());
  --state_.split_count;
  return true;
}

// The split of the diamond that the cursor found last; it is shown, and no child's is.
void Front::hide(FrontCursor& at) {
  Block& block = state_.obtain_block(at.scale(), at.position());
  state_.tet_count -= std::uint64_t(at.added_tets(block.of[at.slot()]));
  block.shown &= ~bit(at.slot());
  --state_.shown_count;
}

bool Front::hide(Handle handle) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  if (!cursor.gather(handle.slot) || !cursor.is_shown() || cursor.has_child_in(&Block::shown)) return false;
  hide(cursor);
  return true;
}

bool Front::show(Handle handle, std::uint64_t max_tets) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  if (!cursor.gather(handle.slot) || !cursor.is_split() || cursor.is_shown() || !cursor.parents_are_shown()) return false;
  Block& block = state_.obtain_block(cursor.scale(), cursor.position());
  const std::uint64_t tets = state_.tet_count + std::uint64_t(cursor.added_tets(block.of[handle.slot]));
  if (tets > max_tets) return false;
  state_.tet_count = tets;
  block.shown |= bit(handle.slot);
  ++state_.shown_count;
  return true;
}

void Front::forget(std::span<const SlotGroup> groups) {
  SupercubeNeighbours<BlockFinder> neighbours(state_);
  const auto split_slots = [this](const Block* block) { return state_.is_root_block(*block) ? 0 : block->split; };
  merge_finest_first(groups, neighbours, split_slots, [this](const SlotGroup& group, Slot slot) {
    hide(Handle{group.key, slot});
    state_.obtain_block(scale_of_key(group.key), position_of_key(group.key)).split &= ~bit(slot);
    --state_.split_count;
  });
  state_.pack();
}

std::vector<SlotGroup> Front::splits() const {
  std::vector<SlotGroup> splits;
  for (const Block& b : state_.blocks) {
    if (!state_.is_root_block(b) && b.split != 0) splits.push_back({{}, {}, supercube_key(b.scale, b.position), b.split});
  }
  std::sort(splits.begin(), splits.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.key < b.key; });
  return splits;
}

std::uint64_t Front::shown_slots(SupercubeKey supercube) const {
  const Block* const block = state_.find_block(scale_of_key(supercube), position_of_key(supercube));
  return block == nullptr ? 0 : block->shown;
}

bool Front::is_hidden(Handle handle) const {
  const Block* const block = state_.find_block(scale_of_key(handle.supercube), position_of_key(handle.supercube));
  return block != nullptr && ((block->split & ~block->shown) >> handle.slot & 1) != 0;
}

}  // namespace intervale
