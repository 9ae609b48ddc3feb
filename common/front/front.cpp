#include "common/front/front.h"

#include <algorithm>
#include <cassert>

#include "common/patch/tet_cases.h"

namespace intervale {
namespace {

// A supercube's place in the index. Positions have no more than 19 bits.
std::uint64_t index_key(int scale, Vertex p) {
  return std::uint64_t(scale) << 57 | std::uint64_t(std::uint32_t(p.z)) << 38 | std::uint64_t(std::uint32_t(p.y)) << 19 | std::uint32_t(p.x);
}

}  // namespace

// The corners of the domain are no diamonds, but seven of them have the offsets of diamonds of scale N whose centres lie there, and the root's edges
// are those diamonds' subdivision edges: the base is one more supercube.
Front::Front(const Grid& grid, const Base& base) : grid_(grid), domain_(grid.dims) {
  const Diamond root(domain_.root());
  const Existing e = existing(root);
  const Links& links = link_table()[0][kSlotOfType[root.type]];
  Block& corners = obtain_block(domain_.levels(), {});
  std::uint32_t sides = 0;
  for (int v = 0; v < kRootVertices; ++v) {
    const Link link = links.vertex[v];
    const Vertex corner = root.vertex(v);
    const bool is_origin = (corner.x | corner.y | corner.z) == 0;
    Block& block = is_origin ? corner_ : corners;
    assert((is_origin || link.where == kCoarser) && "the other corners are in the supercube at (0, 0, 0)");
    Split& s = block.of[is_origin ? 0 : link.slot];
    block.split |= std::uint64_t(1) << (is_origin ? 0 : link.slot);
    block.shown = block.split;
    s.bits = std::uint32_t(base.side[v]) << kSideBit;
    sides |= std::uint32_t(base.side[v]) << (2 * v);
    // Its cuts in order of the other end's number, which is not the order of the root's edges.
    std::array<const Cuts*, kMaxVertices> cuts{};
    std::array<bool, kMaxVertices> turned{};
    for (int k = 0; k < kRootEdges; ++k) {
      if (links.edge[k].owner != v || !(e.edges >> k & 1)) continue;
      cuts[links.edge[k].other] = &base.cuts[k];
      turned[links.edge[k].other] = edge_ends(k, root.row->belt)[0] != v;
      const auto [a, b] = edge_ends(k, root.row->belt);
      const std::uint32_t two = unsigned(alpha_cuts(base.side[a], base.side[b])) | unsigned(beta_cuts(base.side[a], base.side[b])) << 1;
      s.bits |= two << (2 * links.edge[k].other);
    }
    s.first = std::uint32_t(q_.size());
    for (int other = 0; other < kMaxVertices; ++other) {
      if (cuts[other] == nullptr) continue;
      const Cuts c = turned[other] ? reversed(*cuts[other]) : *cuts[other];
      q_.insert(q_.end(), c.q, c.q + c.count);
    }
    q_.push_back(0);
  }
  tet_count_ = count_tets(root, e, sides);
}

std::optional<Front::Handle> Front::find(Vertex centre) const {
  if ((centre.x | centre.y | centre.z) <= 0 || scale_of(centre) >= domain_.levels()) return {};
  const std::int32_t most = 1 << domain_.levels();
  if (centre.x > most || centre.y > most || centre.z > most) return {};
  const Diamond d(centre);
  const Vertex position{centre.x >> (d.scale + 2), centre.y >> (d.scale + 2), centre.z >> (d.scale + 2)};
  Cursor cursor(*this);
  cursor.move_to(d.scale, position);
  const int slot = kSlotOfType[d.type];
  if (!cursor.find(slot)) return {};
  return Handle{supercube_key(d.scale, position), slot};
}

DiamondContext Front::context(Handle handle) const {
  Cursor cursor(*this);
  cursor.move_to(handle.supercube);
  cursor.gather(handle.slot);
  return cursor.look_closer();
}

void Front::split(Handle handle, Side side, std::span<const std::uint8_t> cuts) {
  Cursor cursor(*this);
  cursor.move_to(handle.supercube);
  cursor.gather(handle.slot);
  cursor.split(side, cuts);
}

bool Front::merge(Vertex centre) {
  if ((centre.x | centre.y | centre.z) <= 0 || scale_of(centre) >= domain_.levels()) return false;
  const Diamond d(centre);
  const int slot = kSlotOfType[d.type];
  const Block* const found = find_block(d.scale, {centre.x >> (d.scale + 2), centre.y >> (d.scale + 2), centre.z >> (d.scale + 2)});
  if (found == nullptr || !(found->split >> slot & 1)) return false;
  if (has_children_among(d, existing(d), &Block::split)) return false;
  if (found->shown >> slot & 1) hide({supercube_key(d.scale, found->position), slot});
  const_cast<Block*>(found)->split &= ~(std::uint64_t(1) << slot);
  --split_count_;
  return true;
}

bool Front::has_children_among(const Diamond& d, const Existing& e, std::uint64_t Block::*slots) const {
  for (int k = 0; k < d.row->children && d.has_children(); ++k) {
    const Diamond child(d.child(k));
    bool handed = false;
    for (const Duet::Half& half : d.row->child[k].half) handed = handed || ((e.tets >> half.tet & 1) && half_exists(d, half.tet, half.end));
    if (!handed) continue;
    const int up = child.scale + 2;
    const Block* const block = find_block(child.scale, {child.centre.x >> up, child.centre.y >> up, child.centre.z >> up});
    if (block != nullptr && (block->*slots >> kSlotOfType[child.type] & 1)) return true;
  }
  return false;
}

bool Front::hide(Handle handle) {
  Cursor cursor(*this);
  cursor.move_to(handle.supercube);
  if (!cursor.gather(handle.slot)) return false;
  Block& block = obtain_block(scale_of_key(handle.supercube), position_of_key(handle.supercube));
  if (!(block.shown >> handle.slot & 1) || has_children_among(cursor.diamond(), cursor.existing_, &Block::shown)) return false;
  tet_count_ -= std::uint64_t(cursor.added_tets(block.of[handle.slot]));
  block.shown &= ~(std::uint64_t(1) << handle.slot);
  --shown_count_;
  return true;
}

bool Front::show(Handle handle, std::uint64_t max_tets) {
  Cursor cursor(*this);
  cursor.move_to(handle.supercube);
  if (!cursor.gather(handle.slot) || !cursor.is_split()) return false;
  Block& block = obtain_block(scale_of_key(handle.supercube), position_of_key(handle.supercube));
  if ((block.shown >> handle.slot & 1) || !cursor.parents_are_shown()) return false;
  const std::uint64_t tets = tet_count_ + std::uint64_t(cursor.added_tets(block.of[handle.slot]));
  if (tets > max_tets) return false;
  tet_count_ = tets;
  block.shown |= std::uint64_t(1) << handle.slot;
  ++shown_count_;
  return true;
}

// A child is one by its place, whether it was handed anything or not: so says the server too, which knows no more.
void Front::forget(std::span<const SlotGroup> groups) {
  const auto has_split_child = [this](const Diamond& d) {
    for (int k = 0; k < d.row->children && d.has_children(); ++k) {
      const Diamond child(d.child(k));
      const int up = child.scale + 2;
      const Block* const block = find_block(child.scale, {child.centre.x >> up, child.centre.y >> up, child.centre.z >> up});
      if (block != nullptr && (block->split >> kSlotOfType[child.type] & 1)) return true;
    }
    return false;
  };
  for_each_finest_first(groups, [&](const SlotGroup& g, std::uint64_t slots) {
    const int scale = scale_of_key(g.key);
    const std::uint32_t number = scale < domain_.levels() ? find_number(scale, position_of_key(g.key)) : kNone;
    if (number == kNone) return;
    Block& block = blocks_[number];
    for (std::uint64_t left = slots & block.split; left != 0; left &= left - 1) {
      const int slot = std::countr_zero(left);
      if (has_split_child(Diamond(centre_of(g.key, slot)))) continue;
      if (block.shown >> slot & 1) hide({g.key, slot});
      block.split &= ~(std::uint64_t(1) << slot);
      --split_count_;
    }
  });
  pack();
}

// Leaves out supercubes without splits, and cuts that belong to none.
void Front::pack() {
  std::deque<Block> blocks;
  std::vector<std::uint8_t> q;
  const auto take = [&](Block& block) {
    block.near = {};
    for (int slot = 0; slot < kSlots; ++slot) {
      Split& s = block.of[slot];
      if (!(block.split >> slot & 1)) {
        s = {};
        continue;
      }
      const std::span<const std::uint8_t> cuts = cuts_of(s);
      s.first = std::uint32_t(q.size());
      q.insert(q.end(), cuts.begin(), cuts.end());
      if (s.side() == Side::inside) q.push_back(0);
    }
  };
  index_.clear();
  take(corner_);
  for (Block& block : blocks_) {
    if (block.split == 0) continue;
    take(block);
    index_.emplace(index_key(block.scale, block.position), std::uint32_t(blocks.size()));
    blocks.push_back(block);
  }
  blocks_ = std::move(blocks);
  q.shrink_to_fit();
  q_ = std::move(q);
  ++renamed_;
}

std::vector<SlotGroup> Front::splits() const {
  std::vector<SlotGroup> splits;
  for (const Block& b : blocks_) {
    if (b.scale < domain_.levels() && b.split != 0) splits.push_back({0, 0, supercube_key(b.scale, b.position), b.split});
  }
  std::sort(splits.begin(), splits.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.key < b.key; });
  return splits;
}

std::uint64_t Front::shown_slots(SupercubeKey supercube) const {
  const Block* const block = find_block(scale_of_key(supercube), position_of_key(supercube));
  return block == nullptr ? 0 : block->shown;
}

bool Front::is_hidden(Handle handle) const {
  const Block* const block = find_block(scale_of_key(handle.supercube), position_of_key(handle.supercube));
  return block != nullptr && ((block->split & ~block->shown) >> handle.slot & 1) != 0;
}

std::size_t Front::memory_bytes() const { return blocks_.size() * sizeof(Block) + index_.bucket_count() * 17 + q_.capacity(); }

std::uint32_t Front::find_number(int scale, Vertex position) const {
  const auto found = index_.find(index_key(scale, position));
  return found == index_.end() ? kNone : found->second;
}

Front::Block& Front::obtain_block(int scale, Vertex position) {
  const auto [place, is_new] = index_.try_emplace(index_key(scale, position), std::uint32_t(blocks_.size()));
  if (is_new) {
    blocks_.emplace_back();
    blocks_.back().position = position;
    blocks_.back().scale = scale;
  }
  return blocks_[place->second];
}

Front::Existing Front::existing(const Diamond& d) const {
  const DiamondType& row = *d.row;
  if (domain_.is_interior(d)) return {(1u << row.tets) - 1, (1u << row.vertices) - 1, (1u << row.edges) - 1, false};
  const unsigned tets = domain_.tets(d);
  return {tets, Domain::vertices(row, tets), Domain::edges(row, tets), !domain_.is_unmoved(d)};
}

// On an axis that clamps, at or beyond the last sample. Only edges with such an end can share their place with another edge.
bool Front::is_border(Vertex v) const {
  const std::int32_t n = 1 << domain_.levels();
  const Vertex last = domain_.last();
  return (last.x < n && v.x >= last.x) || (last.y < n && v.y >= last.y) || (last.z < n && v.z >= last.z);
}

bool Front::half_exists(const Diamond& d, int tet, int end) const {
  auto local = d.row->tet(tet);
  local[1 - end] = kCentre;
  return Domain::exists(domain_.positions(d, local));
}

TetShape Front::shape(const Diamond& d, const Existing& e, int tet) const {
  const auto local = d.row->tet(tet);
  return e.straddles ? shape_of(domain_.positions(d, local), local, d.row->belt) : d.row->shape[tet];
}

TetShape Front::half_shape(const Diamond& d, const Existing& e, int tet, int end) const {
  if (!e.straddles) return d.row->half_shape[tet][end];
  auto local = d.row->tet(tet);
  local[1 - end] = kCentre;
  return shape_of(domain_.positions(d, local), local, d.row->belt);
}

std::uint64_t Front::count_tets(const Diamond& d, const Existing& e, std::uint32_t sides) const {
  const TetCases& cases = tet_cases();
  const Ring ring(sides, d.row->belt);
  std::uint64_t n = 0;
  for (int t = 0; t < d.row->tets; ++t) {
    if (!(e.tets >> t & 1)) continue;
    unsigned count = cases.count(ring.tet(t));
    if (count == TetCases::kDepends) {
      const TetShape s = shape(d, e, t);
      count = cases.count(s.order, shape_sides(s, sides));
    }
    n += count;
  }
  return n;
}

std::uint64_t Front::count_halves(const Diamond& d, const Existing& e, std::uint32_t sides) const {
  const TetCases& cases = tet_cases();
  const Ring ring(sides, d.row->belt);
  std::uint64_t n = 0;
  for (int t = 0; t < d.row->tets; ++t) {
    if (!(e.tets >> t & 1)) continue;
    for (int end = 0; end < 2; ++end) {
      if (e.straddles && !half_exists(d, t, end)) continue;
      unsigned count = cases.count(ring.half(t, end));
      if (count == TetCases::kDepends) {
        const TetShape s = half_shape(d, e, t, end);
        count = cases.count(s.order, shape_sides(s, sides));
      }
      n += count;
    }
  }
  return n;
}

}  // namespace intervale
