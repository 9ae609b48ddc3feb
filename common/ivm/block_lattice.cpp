#include "common/ivm/block_lattice.h"

#include <algorithm>

namespace intervale {

std::vector<BrickRun> blocks_of(const SupercubeSet& set) {
  const auto bricks = set.bricks();
  std::vector<BrickRun> blocks;
  for (BrickIndex brick{0}; brick < bricks.size(); ++brick) {
    if (blocks.empty() || block_of(bricks[blocks.back().first].key) != block_of(bricks[brick].key)) blocks.push_back({brick, brick});
    blocks.back().end = brick + 1;
  }
  return blocks;
}

BlockLattice::BlockLattice(const PagedValues& values)
    : corners_(values.corners),
      set_(values.set),
      values_(values.keys),
      levels_(Domain(values.grid.dims).levels()),
      keys_(std::size_t(kSide) * kSide * kSide, kNoKey) {}

BlockLattice::Offsets BlockLattice::make_offsets() {
  Offsets table;
  for (Slot slot{0}; slot < kSlots; ++slot) {
    const unsigned type = kTypeOfSlot[slot];
    const DiamondType& row = diamond_type(type);
    const auto bits = [type](unsigned shift) { return std::int32_t(type >> shift & 3); };
    table.centre[slot] = point_of(bits(0), bits(2), bits(4)) - point_of(0, 0, 0);
    for (std::size_t v = 0; v < row.vertices; ++v) {
      const Offset to = row.vertex[v];
      table.vertex[slot][v] = point_of(to.x, to.y, to.z) - point_of(0, 0, 0);
    }
  }
  return table;
}

BlockLattice::Point BlockLattice::at(SupercubeKey key) const {
  const Vertex p = position_of_key(key);
  return point_of(p.x * 4 - first_.x, p.y * 4 - first_.y, p.z * 4 - first_.z);
}

void BlockLattice::move_to(BlockKey block, Load load) {
  const SupercubeKey key = block << kBlockBits;
  scale_ = scale_of_key(key);
  const Vertex position = position_of_key(key);
  first_ = {position.x * 4, position.y * 4, position.z * 4};
  std::fill(keys_.begin(), keys_.end(), kNoKey);
  const Diamond root(Vertex{1 << (levels_ - 1), 1 << (levels_ - 1), 1 << (levels_ - 1)});
  for (int v = 0; v < kRootVertices; ++v) {
    const Vertex c = root.vertex(v), p{(c.x >> scale_) - first_.x, (c.y >> scale_) - first_.y, (c.z >> scale_) - first_.z};
    if (std::min({p.x, p.y, p.z}) < 0 || std::max({p.x, p.y, p.z}) > kSide - 2) continue;
    keys_[std::size_t(point_of(p.x, p.y, p.z))] = corners_[std::size_t(v)];
  }
  for (int scale = levels_ - 1; scale > scale_; --scale) load_scale(scale, false);
  if (load != Load::coarser) load_scale(scale_, load == Load::own);
}

// Sets the points of one scale.
void BlockLattice::load_scale(int scale, bool own_only) {
  const int finer = scale - scale_;
  const auto first = [&](std::int32_t c) { return own_only ? c >> 2 : std::max(c - 1, 0) >> (finer + 2); };
  const auto last = [&](std::int32_t c) { return (c + kSide - (own_only ? 3 : 2)) >> (finer + 2); };
  for (std::int32_t z = first(first_.z); z <= last(first_.z); ++z) {
    for (std::int32_t y = first(first_.y); y <= last(first_.y); ++y) {
      for (std::int32_t x = first(first_.x); x <= last(first_.x); ++x) {
        const auto found = set_.find_supercube(scale, {x, y, z});
        if (!found) continue;
        UpdateIndex next = set_.first(found->brick, found->supercube);
        for (const Slot slot : set_bits<Slot>(set_.occupancy()[found->supercube])) {
          const UpdateIndex i = next++;
          const unsigned type = kTypeOfSlot[slot];
          const std::int32_t px = ((x << 2 | std::int32_t(type & 3)) << finer) - first_.x,
                             py = ((y << 2 | std::int32_t(type >> 2 & 3)) << finer) - first_.y,
                             pz = ((z << 2 | std::int32_t(type >> 4 & 3)) << finer) - first_.z;
          if (std::min({px, py, pz}) < -1 || std::max({px, py, pz}) > kSide - 2) continue;
          keys_[std::size_t(point_of(px, py, pz))] = values_[i];
        }
      }
    }
  }
}

}  // namespace intervale
