#include "server/volume/sample_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/patch/visit_samples.h"
#include "server/volume/nrrd.h"
#include "server/volume/samples.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using std::numbers::pi;

// In slabs of so many rows.
Volume volume_of(const SampleField& field, std::uint64_t rows_a_slab) {
  Volume volume = field.header();
  for (std::uint64_t first = 0; first < field.rows(); first += rows_a_slab) {
    std::vector<std::byte> slab(std::min(rows_a_slab, field.rows() - first) * field.row_bytes());
    field.fill(first, slab);
    volume.bytes.insert(volume.bytes.end(), slab.begin(), slab.end());
  }
  return volume;
}

SampleField field_of(std::string_view name, int size, SampleType type) { return SampleField::create(name, size, type).value(); }

// The formulas as they are written down, sample by sample.
double naive_sample(std::string_view name, double x, double y, double z) {
  if (name == "gyroid") {
    const double u = 2 * pi * x, v = 2 * pi * y, w = 2 * pi * z;
    return std::sin(u) * std::cos(v) + std::sin(v) * std::cos(w) + std::sin(w) * std::cos(u);
  }
  if (name == "marschner-lobb") {
    const double ripple = std::cos(2 * pi * 6 * std::cos(pi * std::hypot(x, y) / 2));
    return 255 * (1 - std::sin(pi * z / 2) + 0.25 * (1 + ripple)) / (2 * (1 + 0.25));
  }
  const double r = 20 * std::hypot(x, y, z), wave = std::exp(-r / 3) * (3 * 20 * z * 20 * z - r * r), peak = 72 * std::exp(-2.0);
  return 255 * (wave / peak) * (wave / peak);
}

TEST(SampleField, SlabsEqualTheWhole) {
  for (const auto name : sample_names())
    for (const int size : {2, 5, 24}) {
      const auto whole = make_sample(name, size);
      ASSERT_TRUE(whole);
      const auto field = field_of(name, size, SampleType::f32);
      for (const std::uint64_t rows : {std::uint64_t(1), std::uint64_t(size), std::uint64_t(3 * size + 1), field.rows()}) {
        const Volume volume = volume_of(field, rows);
        EXPECT_EQ(volume.bytes, whole->bytes) << name << " " << size << " in slabs of " << rows;
        EXPECT_EQ(volume.grid, whole->grid);
        EXPECT_EQ(volume.name, whole->name);
      }
    }
}

// Within the last places: the naive formulas multiply in another order.
TEST(SampleField, FloatsAreTheFormulas) {
  constexpr int kSize = 21;
  for (const std::string_view name : {"gyroid", "marschner-lobb", "hydrogen"}) {
    const Volume fine = volume_of(field_of(name, kSize, SampleType::f64), 100);
    const Volume coarse = volume_of(field_of(name, kSize, SampleType::f32), 100);
    const std::span doubles(reinterpret_cast<const double*>(fine.bytes.data()), fine.grid.sample_count());
    const std::span floats(reinterpret_cast<const float*>(coarse.bytes.data()), coarse.grid.sample_count());
    const auto place = [](int i) { return -1 + 2.0 * i / (kSize - 1); };
    std::size_t at = 0;
    for (int k = 0; k < kSize; ++k)
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize; ++i, ++at) {
          ASSERT_NEAR(doubles[at], naive_sample(name, place(i), place(j), place(k)), 1e-9) << name << " at " << i << " " << j << " " << k;
          ASSERT_EQ(floats[at], float(doubles[at]));
        }
  }
}

TEST(SampleField, WholeNumbersSpanTheirTypeAndAreTheNearest) {
  constexpr int kSize = 41;
  for (const auto name : sample_names()) {
    const bool is_gyroid = name == "gyroid";
    const double least = is_gyroid ? -1.5 : 0, greatest = is_gyroid ? 1.5 : 255;
    const Volume exact = volume_of(field_of(name, kSize, SampleType::f64), kSize);
    const std::span values(reinterpret_cast<const double*>(exact.bytes.data()), exact.grid.sample_count());
    for (int type = 0; type < kSampleTypes; ++type) {
      if (is_float(SampleType(type))) continue;
      SCOPED_TRACE(std::string(name) + " as " + name_of(SampleType(type)));
      const Volume volume = volume_of(field_of(name, kSize, SampleType(type)), kSize);
      EXPECT_EQ(volume.type, SampleType(type));
      visit_samples(volume, [&](auto samples) {
        using T = typename decltype(samples)::value_type;
        const auto lowest = double(std::numeric_limits<T>::min()), highest = double(std::numeric_limits<T>::max());
        ASSERT_EQ(samples.size(), values.size());
        for (std::size_t i = 0; i < samples.size(); ++i) {
          const double step = lowest + (values[i] - least) / (greatest - least) * (highest - lowest);
          ASSERT_LE(std::abs(double(samples[i]) - std::clamp(step, lowest, highest)), 0.5 + 1e-4) << values[i];
        }
      });
    }
  }
}

// 0 to 255 as u8 are merely rounded, and those of i8 are 128 less.
TEST(SampleField, BytesAreTheRoundedValues) {
  const Volume exact = volume_of(field_of("buckyball", 41, SampleType::f64), 41), bytes = volume_of(field_of("buckyball", 41, SampleType::u8), 41),
               signed_bytes = volume_of(field_of("buckyball", 41, SampleType::i8), 41);
  const std::span values(reinterpret_cast<const double*>(exact.bytes.data()), exact.grid.sample_count());
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_EQ(double(bytes.bytes[i]), std::min(std::round(values[i]), 255.0));
    ASSERT_EQ(int(std::int8_t(signed_bytes.bytes[i])), int(bytes.bytes[i]) - 128);
  }
}

TEST(SampleField, FilesWrittenInSlabsEqualThoseOfTheWhole) {
  const TempDir folder;
  for (int type = 0; type < kSampleTypes; ++type) {
    const auto field = field_of("hydrogen", 19, SampleType(type));
    const Volume whole = volume_of(field, field.rows());
    ASSERT_TRUE(write_nrrd(folder / "whole.nrrd", whole));
    auto writer = NrrdWriter::create(folder / "slabs.nrrd", field.header());
    ASSERT_TRUE(writer);
    for (std::uint64_t first = 0; first < field.rows(); ++first) {
      std::vector<std::byte> row(field.row_bytes());
      field.fill(first, row);
      ASSERT_TRUE(writer->write(row));
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "slabs.nrrd")) << "before it is whole";
    ASSERT_TRUE(writer->commit());
    EXPECT_EQ(contents_of(folder / "slabs.nrrd"), contents_of(folder / "whole.nrrd"));
    const auto read = read_nrrd(folder / "slabs.nrrd");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->type, SampleType(type));
    EXPECT_EQ(read->bytes, whole.bytes);
    std::filesystem::remove(folder / "slabs.nrrd");
  }
}

TEST(SampleField, OfAnySizeTakesNoMoreThanItsRows) {
  const auto field = field_of("marschner-lobb", kMaxFieldSize, SampleType::u16);
  EXPECT_EQ(field.rows() * field.row_bytes(), std::uint64_t(1) << 40);
  std::vector<std::byte> last(2 * field.row_bytes());
  field.fill(field.rows() - 2, last);
  EXPECT_FALSE(SampleField::create("gyroid", kMaxFieldSize + 1, SampleType::u8));
  EXPECT_FALSE(SampleField::create("gyroid", 1, SampleType::u8));
}

}  // namespace
}  // namespace intervale
