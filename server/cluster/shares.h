// Who does what: the pages of a data set of every range, and the samples of its box, shared out among ranks.
//
// Pages are runs of blocks on a Morton curve (value_page.h), and each rank gets a run of the pages of scale 0, with about
// as many diamonds as the others. So what a rank has is some boxes of 64 x 64 x 64 samples that lie together. The
// pages of coarser scales, a seventh of all, are shared out likewise, wherever they lie. All of it follows from dims and
// the number of ranks.
//
// Where few samples are left at the far sides of the volume, the blocks are thin. One page has many of them, all over a side,
// and who compresses it would need samples from everywhere. So those samples belong to the boxes before them, whose ranks
// look at them, and all ranks get the keys of thin blocks.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/ivm/block_lattice.h"

namespace intervale {

class Shares {
 public:
  static constexpr int kBoxBits = 6;            // a box has 64 samples on an axis, as a block of scale 0
  static constexpr std::int32_t kCellSide = 8;  // samples on an axis of a cell, as a block of Extremes (interpolation_error.h)
  static constexpr std::int32_t kHalo = 8;      // samples around the own boxes that a rank has, too

  Shares(const Domain& domain, int ranks);

  struct Page {
    std::vector<BlockKey> blocks;
    int rank = 0;
  };
  [[nodiscard]] const std::vector<Page>& pages() const { return pages_; }                          // all, by number
  [[nodiscard]] const std::array<std::size_t, kMaxLevels>& diamonds() const { return diamonds_; }  // by scale
  [[nodiscard]] std::uint64_t supercubes() const { return supercubes_; }                           // of all scales
  [[nodiscard]] int rank_of_sample(Vertex v) const { return rank_of_box_[box_index(v)]; }          // v: in the box
  // Of a block of scale 0: who compresses it (-1: there is none), whether it is thin, and whose samples lie there.
  [[nodiscard]] int rank_of_block(Vertex block) const { return rank_of_block_[block_index(block)]; }
  [[nodiscard]] bool is_thin(Vertex block) const { return block.x >= boxes_.x || block.y >= boxes_.y || block.z >= boxes_.z; }
  [[nodiscard]] int rank_of_samples_in(Vertex block) const { return rank_of_sample({block.x << kBoxBits, block.y << kBoxBits, block.z << kBoxBits}); }
  [[nodiscard]] std::vector<Vertex> blocks() const;  // all of scale 0
  // Whether a rank has one of the samples [low, high], which lie in the box.
  [[nodiscard]] bool has_any(int rank, Vertex low, Vertex high) const;

  // The cells of a rank, a bit each, x fastest: of its boxes; and also those within kHalo of them.
  [[nodiscard]] std::vector<bool> own_cells(int rank) const { return cells_around(rank, 0); }
  [[nodiscard]] std::vector<bool> known_cells(int rank) const { return cells_around(rank, kHalo); }

 private:
  [[nodiscard]] std::size_t box_index(Vertex v) const {
    const auto box = [](std::int32_t c, std::int32_t boxes) { return std::size_t(std::min(c >> kBoxBits, boxes - 1)); };
    return (box(v.z, boxes_.z) * std::size_t(boxes_.y) + box(v.y, boxes_.y)) * std::size_t(boxes_.x) + box(v.x, boxes_.x);
  }
  [[nodiscard]] std::size_t block_index(Vertex b) const {
    return (std::size_t(b.z) * std::size_t(blocks_.y) + std::size_t(b.y)) * std::size_t(blocks_.x) + std::size_t(b.x);
  }
  void share_pages(int ranks, bool finest, const std::vector<std::uint64_t>& diamonds_of_page);
  [[nodiscard]] std::vector<bool> cells_around(int rank, std::int32_t halo) const;
  void add_cells(std::vector<bool>& cells, Vertex low, Vertex high) const;

  Vertex last_, boxes_, blocks_;
  std::vector<Page> pages_;
  std::array<std::size_t, kMaxLevels> diamonds_{};
  std::uint64_t supercubes_ = 0;
  std::vector<int> rank_of_box_, rank_of_block_;
};

// Calls visit(y, z, first x, last x) for the rows of samples in some cells of a box.
template <class Visit>
void for_each_run(const std::vector<bool>& cells, Vertex last, std::int32_t first_z, std::int32_t last_z, const Visit& visit) {
  constexpr std::int32_t kSide = Shares::kCellSide;
  const std::int32_t nx = last.x / kSide + 1, ny = last.y / kSide + 1;
  for (std::int32_t z = first_z; z <= last_z; ++z) {
    for (std::int32_t y = 0; y <= last.y; ++y) {
      const std::size_t row = (std::size_t(z / kSide) * std::size_t(ny) + std::size_t(y / kSide)) * std::size_t(nx);
      for (std::int32_t begin = 0, end = 0; begin < nx; begin = end + 1) {
        end = begin;
        while (end < nx && cells[row + std::size_t(end)]) ++end;
        if (end > begin) visit(y, z, begin * kSide, std::min(end * kSide - 1, last.x));
      }
    }
  }
}

}  // namespace intervale
