// Pages: the values and errors of some diamonds, coded together. FORMAT.md is the specification.
//
// A page is a run of blocks (block_lattice.h). What is predicted in a block reads only values of the block itself and of
// coarser scales, so a page can be decoded as soon as the coarser pages are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/value_coder.h"
#include "common/ivm/block_lattice.h"
#include "common/ivm/paged_values.h"
#include "common/util/parallel.h"

namespace intervale {

// A page: some blocks.
using ValuePage = std::vector<BrickRun>;

inline constexpr std::uint32_t kPageValuesMost = 1 << 18;  // in a page of more than one block

// The pages of a set, in order of their numbers, none empty. The first one has the coarsest scales, as many whole ones as
// fit; each further one has blocks of one scale.
[[nodiscard]] std::vector<ValuePage> pages_of(const SupercubeSet& set);

// The same, from the numbers of diamonds of all blocks, in their order: with which block each page begins.
struct BlockSize {
  int scale = 0;
  std::uint32_t diamonds = 0;
};
[[nodiscard]] std::vector<std::size_t> page_starts(std::span<const BlockSize> blocks);
// The blocks of all diamonds of a scale (all_diamonds()), in order, none empty. Some microseconds for each.
[[nodiscard]] std::vector<BlockSize> block_sizes(const Domain& domain, int scale);

// The bytes of a page: the keys of its diamonds, and their error levels if the data set has them. Needs 2 MB.
[[nodiscard]] std::vector<std::uint8_t> encode_page(const PagedValues& values, const ValuePage& page);

// The inverse, for bytes from outside: sets the page's keys and error levels, in arrays that have their sizes; those of
// all coarser scales are set. False if the bytes are not a page, or if the set lacks an end of a diamond's spine. Pages of
// one scale may be decoded at the same time.
[[nodiscard]] bool decode_page(const DecodedValues& to, const ValuePage& page, std::span<const std::uint8_t> bytes);

// The least-squares coefficients that predict the values best, by class and scale. Set, keys and description are known;
// the weights are not read. Of very many diamonds of a scale, a quarter is enough. The same for any number of threads.
[[nodiscard]] ValueWeights fit_weights(const PagedValues& values, const ParallelFor& parallel = serial);

// The normal equations of one class and scale, in whole numbers: their sums do not depend on the order of the terms.
struct NormalEquations {
  __extension__ using Wide = __int128;
  std::array<std::array<Wide, kPredictors>, kPredictors> product{};  // the lower triangle
  std::array<Wide, kPredictors> target{};

  void add(const PredictorValues& values, ValueKey key);
  void add(const NormalEquations& other);
};

// The same from parts of the values, whose sums are added in any order: they are whole numbers.
struct WeightSums {
  // blocks: some of the set. all: the diamonds of each scale, whether or not they are in this set.
  void add(const PagedValues& values, std::span<const BrickRun> blocks, std::span<const std::size_t, kMaxLevels> all,
           const ParallelFor& parallel = serial);
  void add(const WeightSums& other);
  [[nodiscard]] ValueWeights solve() const;

  std::array<std::array<NormalEquations, 3>, kMaxLevels> of{};  // by scale and class
};

}  // namespace intervale
