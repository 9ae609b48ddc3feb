#include "server/cluster/shares.h"

#include <algorithm>
#include <bit>
#include <map>
#include <utility>

#include "common/ivm/value_page.h"
#include "common/ivm/value_volume.h"

namespace intervale {
namespace {

Vertex block_of_scale_0(BlockKey block) {
  const Vertex p = position_of_key(block << kBlockBits);
  return {p.x >> 4, p.y >> 4, p.z >> 4};
}

}  // namespace

Shares::Shares(const Domain& domain, int ranks) : last_(domain.last()) {
  std::map<BlockKey, std::uint32_t> sizes;  // the diamonds of each block, in order
  auto at = sizes.end();                    // the last one
  for (int scale = 0; scale < domain.levels(); ++scale) {
    const Vertex last = last_supercube(domain, scale);
    for (Vertex p; p.z <= last.z; ++p.z) {
      for (p.y = 0; p.y <= last.y; ++p.y) {
        for (p.x = 0; p.x <= last.x; ++p.x) {
          const auto diamonds = std::uint32_t(std::popcount(updated_slots(domain, scale, p)));
          if (diamonds == 0) continue;
          const BlockKey block = block_of(supercube_key(scale, p));
          if (at == sizes.end() || at->first != block) at = sizes.try_emplace(block).first;
          at->second += diamonds;
          diamonds_[std::size_t(scale)] += diamonds;
          ++supercubes_;
        }
      }
    }
  }
  std::vector<BlockSize> blocks;
  blocks.reserve(sizes.size());
  for (const auto& [block, diamonds] : sizes) blocks.push_back({scale_of_key(block << kBlockBits), diamonds});
  std::vector<std::size_t> starts = page_starts(blocks);
  starts.push_back(blocks.size());
  std::vector<std::uint64_t> diamonds_of_page;
  auto next = sizes.begin();
  for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
    std::uint64_t diamonds = 0;
    for (pages_.emplace_back(); pages_.back().blocks.size() < starts[i + 1] - starts[i]; ++next) {
      pages_.back().blocks.push_back(next->first);
      diamonds += next->second;
    }
    diamonds_of_page.push_back(diamonds);
  }
  share_pages(ranks, false, diamonds_of_page);
  share_pages(ranks, true, diamonds_of_page);

  const auto boxes = [](std::int32_t end) { return std::max(1, (end - kHalo + (1 << kBoxBits) - 1) >> kBoxBits); };
  boxes_ = {boxes(last_.x + 1), boxes(last_.y + 1), boxes(last_.z + 1)};
  const Vertex last = last_supercube(domain, 0);
  blocks_ = {(last.x >> 4) + 1, (last.y >> 4) + 1, (last.z >> 4) + 1};
  rank_of_box_.assign(std::size_t(boxes_.x) * std::size_t(boxes_.y) * std::size_t(boxes_.z), 0);
  rank_of_block_.assign(std::size_t(blocks_.x) * std::size_t(blocks_.y) * std::size_t(blocks_.z), -1);
  for (const Page& page : pages_) {
    for (const BlockKey block : page.blocks) {
      if (scale_of_key(block << kBlockBits) != 0) continue;
      const Vertex b = block_of_scale_0(block);
      rank_of_block_[block_index(b)] = page.rank;
      if (!is_thin(b)) rank_of_box_[box_index({b.x << kBoxBits, b.y << kBoxBits, b.z << kBoxBits})] = page.rank;
    }
  }
}

// Runs of pages with about equally many diamonds. finest: those of scale 0; else the others.
void Shares::share_pages(int ranks, bool finest, const std::vector<std::uint64_t>& diamonds_of_page) {
  const auto is_meant = [&](std::size_t page) { return (scale_of_key(pages_[page].blocks.back() << kBlockBits) == 0) == finest; };
  std::uint64_t all = 0, before = 0;
  for (std::size_t page = 0; page < pages_.size(); ++page) all += is_meant(page) ? diamonds_of_page[page] : 0;
  for (std::size_t page = 0; page < pages_.size(); ++page) {
    if (!is_meant(page)) continue;
    pages_[page].rank = int((double(before) + double(diamonds_of_page[page]) / 2) / double(all) * ranks);
    before += diamonds_of_page[page];
  }
}

bool Shares::has_any(int rank, Vertex low, Vertex high) const {
  constexpr std::int32_t kSide = 1 << kBoxBits;
  for (std::int32_t z = low.z & -kSide; z <= high.z; z += kSide) {
    for (std::int32_t y = low.y & -kSide; y <= high.y; y += kSide) {
      for (std::int32_t x = low.x & -kSide; x <= high.x; x += kSide) {
        if (rank_of_sample({x, y, z}) == rank) return true;
      }
    }
  }
  return false;
}

// Those with a sample in [low, high], both clamped to the box.
void Shares::add_cells(std::vector<bool>& cells, Vertex low, Vertex high) const {
  const auto cell = [](std::int32_t c, std::int32_t last) { return std::size_t(std::clamp(c, 0, last) / kCellSide); };
  const auto nx = std::size_t(last_.x / kCellSide + 1), ny = std::size_t(last_.y / kCellSide + 1);
  for (std::size_t z = cell(low.z, last_.z); z <= cell(high.z, last_.z); ++z) {
    for (std::size_t y = cell(low.y, last_.y); y <= cell(high.y, last_.y); ++y) {
      for (std::size_t x = cell(low.x, last_.x); x <= cell(high.x, last_.x); ++x) cells[(z * ny + y) * nx + x] = true;
    }
  }
}

std::vector<bool> Shares::cells_around(int rank, std::int32_t halo) const {
  std::vector<bool> cells(std::size_t(last_.x / kCellSide + 1) * std::size_t(last_.y / kCellSide + 1) * std::size_t(last_.z / kCellSide + 1));
  // The last box of an axis has what is left.
  const auto end = [](std::int32_t box, std::int32_t boxes, std::int32_t last) { return box + 1 < boxes ? ((box + 1) << kBoxBits) - 1 : last; };
  for (Vertex b; b.z < boxes_.z; ++b.z) {
    for (b.y = 0; b.y < boxes_.y; ++b.y) {
      for (b.x = 0; b.x < boxes_.x; ++b.x) {
        if (rank_of_samples_in(b) != rank) continue;
        add_cells(cells, {(b.x << kBoxBits) - halo, (b.y << kBoxBits) - halo, (b.z << kBoxBits) - halo},
                  {end(b.x, boxes_.x, last_.x) + halo, end(b.y, boxes_.y, last_.y) + halo, end(b.z, boxes_.z, last_.z) + halo});
      }
    }
  }
  return cells;
}

std::vector<Vertex> Shares::blocks() const {
  std::vector<Vertex> blocks;
  for (const Page& page : pages_) {
    for (const BlockKey block : page.blocks) {
      if (scale_of_key(block << kBlockBits) == 0) blocks.push_back(block_of_scale_0(block));
    }
  }
  return blocks;
}

}  // namespace intervale
