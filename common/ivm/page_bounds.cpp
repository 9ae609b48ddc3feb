#include "common/ivm/page_bounds.h"

#include <algorithm>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cstddef>
#include <limits>

#include "common/ivm/value_bounds.h"

namespace intervale {
namespace {

constexpr KeySpan kNone{std::numeric_limits<ValueKey>::max(), 0};
constexpr int kParts = BlockValues::kParts;

void add(KeySpan& to, const KeySpan& more) {
  to.least = std::min(to.least, more.least);
  to.greatest = std::max(to.greatest, more.greatest);
}

constexpr std::size_t part(int x, int y, int z) { return std::size_t((z * kParts + y) * kParts + x); }
constexpr int part_of(int point) { return point < 3 ? 0 : point < 61 ? 1 : 2; }

// The parts of neighbours next to the block, at a distance of -1, 0 or 1 on one axis: [first, last].
struct Parts {
  int first = 0, last = 0;
};
constexpr Parts parts_next_to(int distance) {
  if (distance == 0) return {0, kParts - 1};
  return distance < 0 ? Parts{kParts - 1, kParts - 1} : Parts{0, 0};
}

class Bounds {
 public:
  explicit Bounds(std::span<const BlockValues> blocks) : blocks_(blocks) {
    for (std::size_t i = 0; i < blocks.size(); ++i) number_.emplace(blocks[i].block, i);
    of_block_.assign(blocks.size(), kNone);
  }

  // Of all blocks, from fine to coarse.
  std::vector<KeySpan> find() && {
    std::vector<std::size_t> order(blocks_.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) { return blocks_[a].block > blocks_[b].block; });
    for (const std::size_t i : order) {
      const BlockPlace place = place_of(blocks_[i].block);
      add_own(i, place);
      if (place.scale > 0) add_finer(i, place);
      for_each_coarser_block(blocks_[i].block, [&](BlockKey coarser) {
        if (const auto found = number_.find(coarser); found != number_.end()) add(of_block_[found->second], of_block_[i]);
      });
    }
    return std::move(of_block_);
  }
  [[nodiscard]] std::size_t number(BlockKey block) const { return number_.at(block); }

 private:
  // Calls visit(number, offset) for the blocks of a scale at places from `first` to `last`.
  template <class Visit>
  void for_each_at(int scale, Vertex first, Vertex last, Visit&& visit) const {
    for (Vertex p = first; p.z <= last.z; ++p.z) {
      for (p.y = first.y; p.y <= last.y; ++p.y) {
        for (p.x = first.x; p.x <= last.x; ++p.x) {
          if (std::min({p.x, p.y, p.z}) < 0) continue;
          if (const auto found = number_.find(block_at({scale, p})); found != number_.end()) visit(found->second, p);
        }
      }
    }
  }

  // The points of the block, three before it and two behind.
  void add_own(std::size_t i, const BlockPlace& place) {
    const Vertex& at = place.at;
    for_each_at(place.scale, {at.x - 1, at.y - 1, at.z - 1}, {at.x + 1, at.y + 1, at.z + 1}, [&](std::size_t other, Vertex p) {
      const Parts x = parts_next_to(p.x - at.x), y = parts_next_to(p.y - at.y), z = parts_next_to(p.z - at.z);
      for (int c = z.first; c <= z.last; ++c) {
        for (int b = y.first; b <= y.last; ++b) {
          for (int a = x.first; a <= x.last; ++a) add(of_block_[i], blocks_[other].parts[part(a, b, c)]);
        }
      }
    });
  }

  // All blocks of the next finer scale that meet those points.
  void add_finer(std::size_t i, const BlockPlace& place) {
    const Vertex& at = place.at;
    for_each_at(place.scale - 1, {2 * at.x - 1, 2 * at.y - 1, 2 * at.z - 1}, {2 * at.x + 2, 2 * at.y + 2, 2 * at.z + 2},
                [&](std::size_t other, Vertex) { add(of_block_[i], of_block_[other]); });
  }

  std::span<const BlockValues> blocks_;
  boost::unordered_flat_map<BlockKey, std::size_t> number_;
  std::vector<KeySpan> of_block_;
};

// lattice: it is moved to the block.
BlockValues values_in_block(BlockLattice& lattice, BlockKey block) {
  BlockValues values{block, {}};
  values.parts.fill(kNone);
  lattice.move_to(block, BlockLattice::Load::own);
  for (int z = 0; z < BlockLattice::kSide - 1; ++z) {
    for (int y = 0; y < BlockLattice::kSide - 1; ++y) {
      for (int x = 0; x < BlockLattice::kSide - 1; ++x) {
        const ValueKey key = lattice.key(BlockLattice::point_of(x, y, z));
        if (key != kNoKey) values.parts[part(part_of(x), part_of(y), part_of(z))].add(key);
      }
    }
  }
  return values;
}

}  // namespace

std::vector<BlockValues> values_in(const PagedValues& values, std::span<const BlockKey> blocks, const ParallelFor& parallel) {
  std::vector<BlockValues> found(blocks.size());
  parallel(blocks.size(), [&](std::size_t i) {
    BlockLattice lattice(values);
    found[i] = values_in_block(lattice, blocks[i]);
  });
  return found;
}

std::vector<PageBounds> bounds_of_pages(std::span<const BlockValues> blocks, std::span<const std::vector<BlockKey>> pages) {
  const Bounds numbers(blocks);
  const std::vector<KeySpan> of_block = Bounds(blocks).find();
  std::vector<PageBounds> bounds;
  bounds.reserve(pages.size());
  for (const std::vector<BlockKey>& page : pages) {
    KeySpan all = kNone;
    for (const BlockKey block : page) add(all, of_block[numbers.number(block)]);
    bounds.push_back({all.least, all.greatest});
  }
  return bounds;
}

std::vector<PageBounds> bounds_of_pages(const PagedValues& values, std::span<const ValuePage> pages, const ParallelFor& parallel) {
  std::vector<std::vector<BlockKey>> blocks_of_pages;
  std::vector<BlockKey> keys;
  for (const ValuePage& page : pages) {
    std::vector<BlockKey>& of_page = blocks_of_pages.emplace_back();
    for (const BrickRun& block : page) of_page.push_back(block_of(values.set.bricks()[block.first].key));
    keys.insert(keys.end(), of_page.begin(), of_page.end());
  }
  return bounds_of_pages(values_in(values, keys, parallel), blocks_of_pages);
}

std::vector<bool> pages_for(std::span<const PageBounds> bounds, const ValueFormat& format, const ShownRanges& shown) {
  std::vector<bool> needed(bounds.size());
  for (const ShownRange& one : shown) {
    const CountingKeys counts(KeySides(format, one.range), one.refine);
    for (std::size_t page = 0; page < needed.size(); ++page) needed[page] = needed[page] || counts(bounds[page].least, bounds[page].greatest);
  }
  if (!needed.empty()) needed[0] = true;
  return needed;
}

}  // namespace intervale
