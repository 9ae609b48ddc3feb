#include "common/ivm/value_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <type_traits>

namespace intervale {
namespace {

std::size_t first_of(const SupercubeSet& set, BrickIndex brick) {
  return brick < set.bricks().size() ? std::size_t(set.bricks()[brick].first) : set.size();
}

// What a coder works on, as values to be read.
const PagedValues& read_only(const PagedValues& values) { return values; }
const PagedValues& read_only(const DecodedValues& to) { return to.values; }

// Codes pages. Coder is a RangeEncoder, and Values are PagedValues; or a RangeDecoder, and DecodedValues, which it sets.
template <class Coder, class Values>
class PageCoder {
 public:
  PageCoder(Coder& coder, const Values& values) : coder_(coder), to_(values), values_(read_only(values)), lattice_(values_) {}

  // False if what was decoded is not a page.
  [[nodiscard]] bool code(const ValuePage& page) {
    return std::all_of(page.begin(), page.end(), [this](const BrickRun& block) {
      const SupercubeKey key = values_.set.bricks()[block.first].key;
      lattice_.move_to(block_of(key), BlockLattice::Load::coarser);
      const bool has_levels = values_.error_levels != nullptr && scale_of_key(key) != 0;
      if (!code_keys(block) || (has_levels && !code_error_levels(block))) return false;
      if constexpr (kDecodes) return !coder_.is_overdrawn();
      return true;
    });
  }

 private:
  // Calls visit(index, slot, point) for the diamonds of one class in a block.
  template <class Visit>
  void for_each_in_block(const BrickRun& block, int cls, Visit&& visit) {
    const SupercubeSet& set = values_.set;
    for (BrickIndex brick = block.first; brick < block.end; ++brick) {
      set.for_each_supercube(brick, [&](SupercubeIndex supercube, SupercubeKey key) {
        const std::uint64_t occupancy = set.occupancy()[supercube], slots = occupancy & kSlotsOfClass[std::size_t(cls)];
        if (slots == 0) return;
        UpdateIndex i = set.first(brick, supercube) + count_below(occupancy, std::countr_zero(slots));
        const BlockLattice::Point at = lattice_.at(key);
        for (const Slot slot : set_bits<Slot>(slots)) visit(i++, slot, at + BlockLattice::of_slot(slot));
      });
    }
  }

  // The keys of a block, class by class.
  bool code_keys(const BrickRun& block) {
    const ValueKey last = values_.format.last;
    const int scale = scale_of_key(values_.set.bricks()[block.first].key);
    VertexKeys around{};
    bool is_valid = true;
    for (int cls = 0; cls < 3; ++cls) {
      for_each_in_block(block, cls, [&](UpdateIndex i, Slot slot, BlockLattice::Point centre) {
        lattice_.gather(centre, slot, around);
        is_valid = is_valid && around[0] != kNoKey && around[1] != kNoKey;
        fill_missing(around, diamond_type(kTypeOfSlot[slot]).vertices);
        const ValueKey key = models_.code(coder_, cls, scale, around, values_.weights, last, kDecodes ? 0 : values_.keys[i]);
        is_valid = is_valid && key <= last;
        lattice_.set_key(centre, key);
        if constexpr (kDecodes) to_.keys.set(i, key);
      });
    }
    return is_valid;
  }

  // The error levels of a block, children before parents: a level is no lower than those of the children, and mostly no
  // lower than that of the spine's error.
  bool code_error_levels(const BrickRun& block) {
    least_.assign(std::size_t(BlockLattice::kSide) * BlockLattice::kSide * BlockLattice::kSide, 0);
    bool is_valid = true;
    for (int cls = 2; cls >= 0; --cls) {
      for_each_in_block(block, cls, [&](UpdateIndex i, Slot slot, BlockLattice::Point centre) {
        const auto vertex = [&](int v) { return centre + BlockLattice::to_vertex(slot, v); };
        const ErrorLevel of_spine = level_of(spine_error(values_.format, lattice_.key(vertex(0)), lattice_.key(vertex(1)), lattice_.key(centre)));
        const std::int64_t least = std::max(least_[std::size_t(centre)], of_spine);
        SignedModel& model = cls < 2 ? parent_models_[std::size_t(cls)] : model_of_class_2(slot, centre, int(least));
        const std::int64_t coded = least + model.code(coder_, kDecodes ? 0 : (*values_.error_levels)[i] - least);
        is_valid = is_valid && coded >= 0 && coded < kErrorLevels;
        const auto level = ErrorLevel(coded);
        if constexpr (kDecodes) (*to_.error_levels)[i] = level;
        for (int v = 0; v < diamond_type(kTypeOfSlot[slot]).vertices; ++v) {
          ErrorLevel& of_vertex = least_[std::size_t(vertex(v))];
          of_vertex = std::max(of_vertex, level);
        }
      });
    }
    return is_valid;
  }

  [[nodiscard]] ErrorLevel level_of(double error) const { return ValueVolume::level_of_error(values_.max_error, error); }

  // The children of class 2 are of a finer scale, and not known. What is: the error at the centre of each pair of
  // vertices, and the levels of diamonds with the same parents.
  SignedModel& model_of_class_2(Slot slot, BlockLattice::Point centre, int least) {
    VertexKeys around{};
    lattice_.gather(centre, slot, around);
    fill_missing(around, diamond_type(kTypeOfSlot[slot]).vertices);
    const ValueKey key = lattice_.key(centre);
    double error = 0;
    int parents = 0, sum = 0;
    for (std::size_t v = 2; v < 6; ++v) error = std::max(error, spine_error(values_.format, around[v], around[v + 4], key));
    for (int v = 2; v < 10; v += 2) {
      const int level = least_[std::size_t(centre + BlockLattice::to_vertex(slot, v))];
      parents += int(level != 0);
      sum += level;
    }
    const int pairs = std::clamp(int(level_of(error)) - least, 0, kByPairs - 1);
    const int mean = parents == 0 ? kByParents - 1 : std::clamp((2 * sum + parents) / (2 * parents) - least + 1, 0, kByParents - 2);
    return class_2_models_[std::size_t(pairs)][std::size_t(mean)];
  }

  static constexpr bool kDecodes = std::is_same_v<Values, DecodedValues>;
  static constexpr int kByPairs = 7, kByParents = 8;
  Coder& coder_;
  const Values& to_;
  const PagedValues& values_;
  BlockLattice lattice_;
  std::vector<ErrorLevel> least_;  // by point: the highest level of a diamond so far that has it as a vertex
  ValueModels models_;
  std::array<SignedModel, 2> parent_models_;  // of error levels, of classes 0 and 1
  std::array<std::array<SignedModel, kByParents>, kByPairs> class_2_models_;
};

}  // namespace

std::vector<std::uint8_t> encode_page(const PagedValues& values, const ValuePage& page) {
  RangeEncoder coder;
  const auto pages = std::make_unique<PageCoder<RangeEncoder, PagedValues>>(coder, values);
  (void)pages->code(page);
  return coder.finish();
}

bool decode_page(const DecodedValues& to, const ValuePage& page, std::span<const std::uint8_t> bytes) {
  RangeDecoder coder(bytes);
  const auto pages = std::make_unique<PageCoder<RangeDecoder, DecodedValues>>(coder, to);
  return pages->code(page) && coder.is_spent();
}

std::vector<std::size_t> page_starts(std::span<const BlockSize> blocks) {
  int coarse = kMaxLevels;  // scales from this one on are in the first page
  std::uint64_t coarser = 0;
  for (std::size_t next = 0; coarse > 0; --coarse) {
    while (next < blocks.size() && blocks[next].scale >= coarse - 1) coarser += blocks[next++].diamonds;
    if (coarser > kPageValuesMost) break;
  }
  std::vector<std::size_t> starts;
  int scale_before = kMaxLevels;
  std::uint32_t values = 0;  // in the last page
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const int scale = std::min(blocks[i].scale, coarse);
    if (scale != scale_before || (scale < coarse && values + blocks[i].diamonds > kPageValuesMost)) {
      starts.push_back(i);
      values = 0;
    }
    values += blocks[i].diamonds;
    scale_before = scale;
  }
  return starts;
}

std::vector<BlockSize> block_sizes(const Domain& domain, int scale) {
  const Vertex last = last_supercube(domain, scale);
  std::vector<std::pair<BlockKey, std::uint64_t>> blocks;  // with their diamonds
  for (BlockPlace place{scale, {}}; place.at.z <= last.z >> 4; ++place.at.z) {
    for (place.at.y = 0; place.at.y <= last.y >> 4; ++place.at.y) {
      for (place.at.x = 0; place.at.x <= last.x >> 4; ++place.at.x) {
        const Vertex first{place.at.x << 4, place.at.y << 4, place.at.z << 4};
        const Vertex end{std::min(first.x + 15, last.x), std::min(first.y + 15, last.y), std::min(first.z + 15, last.z)};
        if (const std::uint64_t diamonds = count_diamonds(domain, scale, first, end); diamonds > 0) blocks.emplace_back(block_at(place), diamonds);
      }
    }
  }
  std::sort(blocks.begin(), blocks.end());
  std::vector<BlockSize> sizes;
  sizes.reserve(blocks.size());
  for (const auto& [key, diamonds] : blocks) sizes.push_back({scale, std::uint32_t(diamonds)});
  return sizes;
}

std::vector<ValuePage> pages_of(const SupercubeSet& set) {
  const std::vector<BrickRun> blocks = blocks_of(set);
  std::vector<BlockSize> sizes;
  sizes.reserve(blocks.size());
  for (const BrickRun& block : blocks)
    sizes.push_back({scale_of_key(set.bricks()[block.first].key), std::uint32_t(first_of(set, block.end) - first_of(set, block.first))});
  std::vector<std::size_t> starts = page_starts(sizes);
  std::vector<ValuePage> pages;
  pages.reserve(starts.size());
  starts.push_back(blocks.size());
  for (std::size_t i = 0; i + 1 < starts.size(); ++i)
    pages.emplace_back(blocks.begin() + std::ptrdiff_t(starts[i]), blocks.begin() + std::ptrdiff_t(starts[i + 1]));
  return pages;
}

}  // namespace intervale
