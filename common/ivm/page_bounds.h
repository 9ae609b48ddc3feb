// Which values lie around the pages of a data set of every range: what tells that some ranges do not need a page.
//
// A range needs a diamond if values around the diamond and its descendants lie on both sides of one of its ends
// (value_bounds.h). Descendants of a block's diamonds, and their vertices, reach two points of the block's lattice beyond
// the block, on each side: a diamond reaches one point beyond its centre, and its descendants half as far each as their
// parents. And a range needs the children of such diamonds, whose errors are theirs, too: a block has children of diamonds
// that lie one point before it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/codec/value_prediction.h"
#include "common/ivm/block_lattice.h"
#include "common/ivm/paged_values.h"
#include "common/ivm/value_page.h"
#include "common/patch/shown_range.h"
#include "common/patch/value_format.h"
#include "common/util/parallel.h"

namespace intervale {

// The keys at the points of a block and of its faces, 0 to 64 on each axis.
struct BlockValues {
  static constexpr int kParts = 3;
  BlockKey block = 0;
  // By part of each axis, x fastest: points 0 to 2, 3 to 60 and 61 to 64. Of a part without keys, least is the greater.
  std::array<KeySpan, std::size_t(kParts* kParts* kParts)> parts;
};
// Of these blocks, all of whose points the values have; in their order.
[[nodiscard]] std::vector<BlockValues> values_in(const PagedValues& values, std::span<const BlockKey> blocks, const ParallelFor& parallel = serial);

// blocks: all of the set, in any order. pages: the blocks of each. As many bounds as pages.
[[nodiscard]] std::vector<PageBounds> bounds_of_pages(std::span<const BlockValues> blocks, std::span<const std::vector<BlockKey>> pages);
// The same from the values of all diamonds. The same for any number of threads.
[[nodiscard]] std::vector<PageBounds> bounds_of_pages(const PagedValues& values, std::span<const ValuePage> pages,
                                                      const ParallelFor& parallel = serial);

// Which pages these ranges need. The first one is among them. With a page, all coarser ones that it is decoded with.
[[nodiscard]] std::vector<bool> pages_for(std::span<const PageBounds> bounds, const ValueFormat& format, const ShownRanges& shown);

}  // namespace intervale
