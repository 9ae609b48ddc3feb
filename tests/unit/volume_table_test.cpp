#include "common/ivm/volume_table.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/domain.h"
#include "common/ivm/extraction.h"
#include "common/mesh/mesh.h"
#include "common/patch/visit_samples.h"
#include "server/builder/cell_tets.h"
#include "server/builder/make_volume_table.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/naive_volume.h"
#include "tests/support/seeds.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

using testing::Dims;

constexpr std::array<Dims, 7> kTableBoxes{{{9, 7, 5}, {9, 9, 9}, {8, 6, 4}, {2, 2, 2}, {3, 8, 2}, {12, 5, 10}, {6, 17, 3}}};

double cells_of(const Volume& v) { return double(v.grid.dims[0] - 1) * double(v.grid.dims[1] - 1) * double(v.grid.dims[2] - 1); }

// The share of the range in the mesh that is refined everywhere.
double naive_share(const Volume& v, const Range& range) {
  const Domain domain(v.grid.dims);
  return testing::naive_sum(v, range, [&domain](Vertex c) { return !domain.is_noop(Diamond(c)); }).volume / cells_of(v);
}

void expect_order(const VolumeTable& t) {
  ASSERT_EQ(t.below.size(), t.position.size());
  ASSERT_EQ(t.not_above.size(), t.position.size());
  EXPECT_EQ(t.below.front(), 0);
  EXPECT_NEAR(t.not_above.back(), 1, 1e-12);
  for (std::size_t j = 0; j < t.position.size(); ++j) {
    EXPECT_LE(t.below[j], t.not_above[j]);
    if (j + 1 == t.position.size()) break;
    EXPECT_LT(t.position[j], t.position[j + 1]);
    EXPECT_LE(t.not_above[j], t.below[j + 1] + 1e-6);
  }
}

template <class T, class Sample>
Volume made(SampleType type, const Dims& dims, Sample&& sample) {
  std::vector<T> samples;
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) samples.push_back(T(sample(x, y, z)));
    }
  }
  return testing::volume_of_type(type, dims, samples);
}

// Fields of every kind: smooth, noisy, with plateaus, with two values, with outliers, by the number `kind`.
constexpr unsigned kKinds = 9;
Volume field(unsigned kind, const Dims& dims, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0, 1);
  const auto smooth = [](int x, int y, int z) { return std::sin(x * 0.3) + std::cos(y * 0.21 + 1) * std::sin(z * 0.17); };
  switch (kind) {
    case 0:
      return testing::gyroid(dims);
    case 1:
      return testing::digits(dims, seed);
    case 2:
      return testing::bump(dims, seed);
    case 3:
      return made<float>(SampleType::f32, dims, [&](int, int, int) { return any(random); });
    case 4:
      return made<std::uint8_t>(SampleType::u8, dims, [&](int x, int y, int) { return x + y > 6 ? 255 : x / 2; });
    case 5:
      return made<std::uint16_t>(SampleType::u16, dims,
                                 [&](int x, int y, int z) { return std::max(0.0, 3000 * smooth(x, y, z)) + double(random() % 30); });
    case 6:
      return made<std::int8_t>(SampleType::i8, dims, [&](int x, int y, int z) { return (x ^ y ^ z) & 1 ? 100 : -100; });
    case 7:
      return made<double>(SampleType::f64, dims, [&](int x, int, int z) { return std::pow(10.0, 15 * any(random)) * (z > x ? 1 : -1e-9); });
    default:
      return made<float>(SampleType::f32, dims, [&](int x, int y, int z) { return 1e6 + 0.25 * std::round(8 * smooth(x, y, z)); });
  }
}

// A value within the volume's range or a little outside, often a sample.
double any_value(const Volume& v, const VolumeTable& table, std::mt19937& random) {
  const double least = table.position.front(), greatest = table.position.back();
  if (random() % 2 == 0) return least + (greatest - least) * (double(random()) * 0x1p-32 * 1.1 - 0.05);
  return testing::sample(v, int(random() % unsigned(v.grid.dims[0])), int(random() % unsigned(v.grid.dims[1])),
                         int(random() % unsigned(v.grid.dims[2])));
}

TEST(VolumeTable, IsTheSumOverTheMeshRefinedEverywhere) {
  for (unsigned seed = 0; seed < kKinds * kTableBoxes.size(); ++seed) {
    const Volume v = field(seed % kKinds, kTableBoxes[seed / kKinds], seed);
    SCOPED_TRACE("seed " + std::to_string(seed));
    const VolumeTable table = make_volume_table(v);
    expect_order(table);
    std::mt19937 random(seed);
    for (unsigned trial = 0; trial < testing::cases(12); ++trial) {
      const double a = any_value(v, table, random), b = trial % 4 == 0 ? a : any_value(v, table, random);
      const Range range{std::min(a, b), std::max(a, b)};
      EXPECT_NEAR(table.share_of(range), naive_share(v, range), kVolumeTolerance) << a << " to " << b;
    }
    for (unsigned trial = 0; trial < testing::cases(6); ++trial) {
      const std::size_t i = random() % table.position.size(), j = random() % table.position.size();
      const Range range{table.position[std::min(i, j)], table.position[std::max(i, j)]};
      EXPECT_NEAR(table.share_of(range), naive_share(v, range), 2e-6) << "between positions";
    }
  }
}

TEST(VolumeTable, IsTheVolumeOfTheExtractedMesh) {
  for (const Dims& dims : {Dims{17, 12, 9}, Dims{9, 7, 5}, Dims{16, 16, 16}}) {
    const Volume v = testing::gyroid(dims);
    const VolumeTable table = make_volume_table(v);
    for (const Range& range : {Range{-0.3, 0.2}, Range{0.5, kInf}, Range{-kInf, -0.1}}) {
      auto extraction = extract(testing::build(v, {.range = range}), Lod{});
      ASSERT_TRUE(extraction);
      // Cuts have 8 bits.
      EXPECT_NEAR(table.share_of(range), volume_of(extraction->front.mesh()) / cells_of(v), 2e-3);
    }
  }
}

// Expects the shares below some values, and of values that are not above them, to be those of all cells.
void expect_shares(const VolumeTable& table, const Volume& v, const std::vector<double>& values) {
  std::vector<double> below(values.size()), not_above(values.size());
  const auto& dims = v.grid.dims;
  for (std::int32_t z = 0; z + 1 < dims[2]; ++z) {
    for (std::int32_t y = 0; y + 1 < dims[1]; ++y) {
      for (std::int32_t x = 0; x + 1 < dims[0]; ++x) {
        const auto corners = cell_corners({x, y, z}, dims[0], std::ptrdiff_t(dims[0]) * dims[1]);
        std::array<double, 8> f{};
        visit_samples(v, [&](auto samples) {
          for (int i = 0; i < 8; ++i) f[i] = double(samples[std::size_t(corners[i] + x + dims[0] * (y + std::ptrdiff_t(dims[1]) * z))]);
        });
        for (const auto& tet : kCellTets) {
          const std::array<double, 4> g{f[tet[0]], f[tet[1]], f[tet[2]], f[tet[3]]};
          const auto [least, greatest] = std::minmax({g[0], g[1], g[2], g[3]});
          for (std::size_t i = 0; i < values.size(); ++i) {
            const double share = testing::share_below(g, values[i]);
            below[i] += share;
            not_above[i] += least == greatest ? double(least <= values[i]) : share;
          }
        }
      }
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_NEAR(table.share_below(values[i]), below[i] / 6 / cells_of(v), kVolumeTolerance) << values[i];
    EXPECT_NEAR(table.share_not_above(values[i]), not_above[i] / 6 / cells_of(v), kVolumeTolerance) << values[i];
  }
}

void expect_tolerance(const Dims& dims, unsigned kind, std::size_t count) {
  SCOPED_TRACE("kind " + std::to_string(kind));
  const Volume v = field(kind, dims, kind);
  const VolumeTable table = make_volume_table(v);
  expect_order(table);
  EXPECT_LT(table.position.size(), 1000u);
  std::mt19937 random(kind);
  std::vector<double> values(count);
  for (double& value : values) value = any_value(v, table, random);
  expect_shares(table, v, values);
}

// Where not every tetrahedron is in the sample by which positions are chosen.
TEST(VolumeTable, HoldsItsToleranceInLargerVolumes) {
  for (unsigned kind = 0; kind < testing::cases(kKinds); ++kind) expect_tolerance({80, 64, 50}, kind, 8);
}

// Where not every cell is summed either.
TEST(VolumeTable, HoldsItsToleranceWhereCellsAreSampled) {
  constexpr std::array kSome{5u, 3u, 0u};
  for (const unsigned kind : std::span(kSome).first(testing::cases(kSome.size()))) expect_tolerance({128, 160, 110}, kind, 4);
}

TEST(VolumeTable, ConstantFieldsAreAJump) {
  for (const double value : {0.0, 7.0, -1e308}) {
    const VolumeTable table = make_volume_table(made<double>(SampleType::f64, {4, 3, 5}, [&](int, int, int) { return value; }));
    EXPECT_EQ(table.position, std::vector<double>{value});
    EXPECT_EQ(table.share_below(value), 0);
    EXPECT_EQ(table.share_not_above(value), 1);
    EXPECT_EQ(table.share_of({value, value}), 1);
    EXPECT_EQ(table.share_of({std::nextafter(value, kInf), kInf}), 0);
  }
}

TEST(VolumeTable, RangesMayBeInfiniteOrMissTheField) {
  for (unsigned kind = 0; kind < kKinds; ++kind) {
    const VolumeTable table = make_volume_table(field(kind, {9, 7, 5}, 1));
    const double least = table.position.front(), greatest = table.position.back();
    EXPECT_NEAR(table.share_of({-kInf, kInf}), 1, 1e-12);
    EXPECT_NEAR(table.share_of({least, greatest}), 1, 1e-12);
    EXPECT_EQ(table.share_of({-kInf, std::nextafter(least, -kInf)}), 0);
    EXPECT_EQ(table.share_of({std::nextafter(greatest, kInf), kInf}), 0);
  }
}

TEST(VolumeTable, TheGreatestDoublesDoNotOverflow) {
  std::mt19937 random(1);
  const double most = std::numeric_limits<double>::max();
  const Volume v = made<double>(SampleType::f64, {9, 9, 9}, [&](int x, int, int) {
    return x == 0 ? -most : x == 8 ? most : double(random()) * 1e298 - 2e307;
  });
  const VolumeTable table = make_volume_table(v);
  expect_order(table);
  EXPECT_NEAR(table.share_of({0, kInf}) + table.share_of({-kInf, 0}), 1, 1e-3);
}

TEST(VolumeTable, DoesNotDependOnTheNumberOfThreads) {
  for (const unsigned kind : {2u, 3u, 5u}) {
    const Volume v = field(kind, {40, 50, 60}, 1);
    const VolumeTable table = make_volume_table(v);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(make_volume_table(v), table);
  }
}

}  // namespace
}  // namespace intervale
