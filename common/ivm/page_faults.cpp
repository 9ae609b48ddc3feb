#include "common/ivm/page_faults.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace intervale {
namespace {

SupercubeKey key_of(const SupercubeSet& set, const BrickRun& block) { return set.bricks()[block.first].key; }

std::string place(const std::array<std::int32_t, 3>& p) {
  return "(" + std::to_string(p[0]) + ", " + std::to_string(p[1]) + ", " + std::to_string(p[2]) + ")";
}

}  // namespace

std::string to_text(const DamagedPage& page) {
  return "page " + std::to_string(page.number) + " of " + std::to_string(page.of) +
         (page.channel.empty() ? "" : " of channel '" + page.channel + "'") + " (scale " + std::to_string(page.scale) + ", samples " +
         place(page.first) + " to " + place(page.last) + ")";
}

std::string to_text(const PageFaults& faults) {
  constexpr std::size_t kMostNamed = 4;
  const std::size_t count = faults.damaged.size();
  std::string text = std::to_string(count) + (count == 1 ? " page is damaged: " : " pages are damaged: ");
  for (std::size_t i = 0; i < std::min(count, kMostNamed); ++i) text += (i == 0 ? "" : ", ") + to_text(faults.damaged[i]);
  return count <= kMostNamed ? text : text + " and " + std::to_string(count - kMostNamed) + " more";
}

void LostPages::lose(std::span<const std::size_t> pages) {
  for (const std::size_t page : pages) {
    is_lost_[page] = true;
    for (const BrickRun& block : pages_[page]) blocks_.push_back(block_of(key_of(set_, block)));
  }
  std::sort(blocks_.begin(), blocks_.end());
}

bool LostPages::needs_lost(std::size_t page) const {
  if (blocks_.empty()) return false;
  bool needs = false;
  for (const BrickRun& block : pages_[page]) {
    for_each_coarser_block(block_of(key_of(set_, block)),
                           [&](BlockKey coarser) { needs = needs || std::binary_search(blocks_.begin(), blocks_.end(), coarser); });
  }
  return needs;
}

DamagedPage place_of(const SupercubeSet& set, std::span<const ValuePage> pages, std::size_t page, const std::array<std::int32_t, 3>& dims) {
  DamagedPage result;
  result.number = page;
  result.of = pages.size();
  result.scale = scale_of_key(key_of(set, pages[page].back()));
  result.first.fill(std::numeric_limits<std::int32_t>::max());
  for (const BrickRun& block : pages[page]) {
    for (BrickIndex brick = block.first; brick < block.end; ++brick) {
      set.for_each_in_brick(brick, ~std::uint64_t(0), [&](const Place& p) {
        const Vertex c = SupercubeSet::centre(p);
        const std::array<std::int32_t, 3> at{c.x, c.y, c.z};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const std::int32_t sample = std::min(at[axis], dims[axis] - 1);
          result.first[axis] = std::min(result.first[axis], sample);
          result.last[axis] = std::max(result.last[axis], sample);
        }
      });
    }
  }
  return result;
}

std::vector<std::uint64_t> slots_left(const Domain& domain, const SupercubeSet& set, const std::vector<bool>& lost) {
  std::vector<std::uint64_t> left(set.occupancy().begin(), set.occupancy().end());
  const std::vector<ValuePage> pages = pages_of(set);
  for (std::size_t page = 0; page < pages.size(); ++page) {
    if (!lost[page]) continue;
    for (const BrickRun& block : pages[page]) {
      for (BrickIndex brick = block.first; brick < block.end; ++brick)
        set.for_each_supercube(brick, [&left](SupercubeIndex s, SupercubeKey) { left[s] = 0; });
    }
  }
  // Parents before children.
  set.for_each_down([&](const Place& p) {
    const std::uint64_t slot = std::uint64_t(1) << unsigned(p.slot);
    if ((left[p.supercube] & slot) == 0) return;
    const Diamond d(SupercubeSet::centre(p));
    for (int k = 0; k < d.row->parents; ++k) {
      const Vertex q = d.parent(k);
      if (domain.clamp(q) != q && domain.tets(Diamond(q)) == 0) continue;  // there is none
      const auto parent = set.find(q);
      if (parent && (left[parent->supercube] >> unsigned(parent->slot) & 1U) == 0) left[p.supercube] &= ~slot;
    }
  });
  return left;
}

}  // namespace intervale
