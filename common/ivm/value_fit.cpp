// Least-squares coefficients for the prediction of values.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/ivm/value_page.h"

namespace intervale {
namespace {

// Cholesky's method, with a little added to the diagonal, so that predictors that agree share the weight.
PredictorWeights solved(const NormalEquations& equations) {
  double trace = 1;
  for (std::size_t i = 0; i < kPredictors; ++i) trace += double(equations.product[i][i]);
  std::array<std::array<double, kPredictors>, kPredictors> root{};
  std::array<double, kPredictors> x{};
  for (std::size_t i = 0; i < kPredictors; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = double(equations.product[i][j]) + (i == j ? 1e-6 * trace : 0);
      for (std::size_t k = 0; k < j; ++k) sum -= root[i][k] * root[j][k];
      root[i][j] = i == j ? std::sqrt(sum) : sum / root[j][j];
    }
    x[i] = double(equations.target[i]);
    for (std::size_t k = 0; k < i; ++k) x[i] -= root[i][k] * x[k];
    x[i] /= root[i][i];
  }
  PredictorWeights weights{};
  for (std::size_t i = kPredictors; i-- > 0;) {
    for (std::size_t k = i + 1; k < kPredictors; ++k) x[i] -= root[k][i] * x[k];
    x[i] /= root[i][i];
    constexpr double kMost = 4 * 256;
    weights[i] = std::int16_t(std::lround(std::clamp(x[i] * 256, -kMost, kMost)));
  }
  return weights;
}

constexpr std::uint32_t kMostFitted = 1 << 20;  // diamonds of a scale; of more, those of a quarter of the supercubes

// Supercubes of a brick, a bit each: one in each row of four, along each axis.
constexpr std::uint64_t kQuarter = [] {
  std::uint64_t mask = 0;
  for (unsigned bit = 0; bit < 64; ++bit) {
    unsigned sum = 0;  // of its coordinates, whose bits take turns
    for (unsigned axis = 0; axis < 3; ++axis) sum += (bit >> axis & 1) + 2 * (bit >> (axis + 3) & 1);
    if (sum % 4 == 0) mask |= std::uint64_t(1) << bit;
  }
  return mask;
}();

using ByClass = std::array<NormalEquations, 3>;

std::size_t diamonds_of_scale(const SupercubeSet& set, int scale) {
  const auto [begin, end] = set.of_scale(scale);
  const std::size_t first_after = end < set.bricks().size() ? std::size_t(set.bricks()[end].first) : set.size();
  return begin == end ? 0 : first_after - set.bricks()[begin].first;
}

// supercubes: of each brick, those that are taken
ByClass equations_of(const PagedValues& values, BlockLattice& lattice, const BrickRun& block, std::uint64_t supercubes) {
  ByClass equations;
  VertexKeys around{};
  lattice.move_to(block_of(values.set.bricks()[block.first].key), BlockLattice::Load::own);
  for (BrickIndex brick = block.first; brick < block.end; ++brick) {
    values.set.for_each_supercube(brick, [&](SupercubeIndex supercube, SupercubeKey key) {
      if ((supercubes >> (key & 63) & 1) == 0) return;
      const BlockLattice::Point at = lattice.at(key);
      UpdateIndex next = values.set.first(brick, supercube);
      for (const Slot slot : set_bits<Slot>(values.set.occupancy()[supercube])) {
        lattice.gather(at + BlockLattice::of_slot(slot), slot, around);
        fill_missing(around, diamond_type(kTypeOfSlot[slot]).vertices);
        const int cls = class_of_slot(slot);
        equations[std::size_t(cls)].add(predictor_values(cls, around), values.keys[next++]);
      }
    });
  }
  return equations;
}

}  // namespace

void NormalEquations::add(const PredictorValues& values, ValueKey key) {
  const std::int64_t difference = 16 * std::int64_t(key) - values.spine;
  for (std::size_t i = 0; i < kPredictors; ++i) {
    for (std::size_t j = 0; j <= i; ++j) product[i][j] += Wide(values.difference[i]) * values.difference[j];
    target[i] += Wide(values.difference[i]) * difference;
  }
}

void NormalEquations::add(const NormalEquations& other) {
  for (std::size_t i = 0; i < kPredictors; ++i) {
    for (std::size_t j = 0; j <= i; ++j) product[i][j] += other.product[i][j];
    target[i] += other.target[i];
  }
}

void WeightSums::add(const PagedValues& values, std::span<const BrickRun> blocks, std::span<const std::size_t, kMaxLevels> all,
                     const ParallelFor& parallel) {
  const auto scale_of_block = [&values](const BrickRun& block) { return std::size_t(scale_of_key(values.set.bricks()[block.first].key)); };
  std::vector<ByClass> found(blocks.size());
  parallel(blocks.size(), [&](std::size_t i) {
    BlockLattice lattice(values);
    const bool is_large = all[scale_of_block(blocks[i])] > kMostFitted;
    found[i] = equations_of(values, lattice, blocks[i], is_large ? kQuarter : ~std::uint64_t(0));
  });
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    ByClass& sum = of[scale_of_block(blocks[i])];
    for (std::size_t cls = 0; cls < 3; ++cls) sum[cls].add(found[i][cls]);
  }
}

void WeightSums::add(const WeightSums& other) {
  for (std::size_t scale = 0; scale < kMaxLevels; ++scale) {
    for (std::size_t cls = 0; cls < 3; ++cls) of[scale][cls].add(other.of[scale][cls]);
  }
}

ValueWeights WeightSums::solve() const {
  ValueWeights weights;
  for (std::size_t scale = 0; scale < kMaxLevels; ++scale) {
    for (std::size_t cls = 0; cls < 3; ++cls) weights.of[scale][cls] = solved(of[scale][cls]);
  }
  return weights;
}

ValueWeights fit_weights(const PagedValues& values, const ParallelFor& parallel) {
  std::array<std::size_t, kMaxLevels> all{};
  for (int scale = 0; scale < kMaxLevels; ++scale) all[std::size_t(scale)] = diamonds_of_scale(values.set, scale);
  WeightSums sums;
  sums.add(values, blocks_of(values.set), all, parallel);
  return sums.solve();
}

}  // namespace intervale
