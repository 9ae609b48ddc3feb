// Values that no step gives back (--step 0): tables of values, through files and streams.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <string>

#include "client/core/client_session.h"
#include "common/ivm/every_range.h"
#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/mesh/mesh_digest.h"
#include "common/ranges/find_relevant_updates.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "tests/support/naive_volume.h"
#include "tests/support/seeds.h"
#include "tests/support/session_server.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using Dims = std::array<std::int32_t, 3>;

// Any finite bits: all exponents, both signs; and zeros, the smallest and the greatest numbers.
double wild_number(std::mt19937_64& random) {
  constexpr double kSpecial[] = {0.0, -0.0, 5e-324, -5e-324, 2.2e-308, -2.2e-308, 1.7976931348623157e308, -1.7976931348623157e308};
  if (random() % 16 == 0) return kSpecial[random() % std::size(kSpecial)];
  double value = 0;
  do {
    const std::uint64_t bits = random();
    std::memcpy(&value, &bits, sizeof value);
  } while (!std::isfinite(value));
  return value;
}

template <class T>
Volume whole_span(SampleType type, const Dims& dims, std::mt19937_64& random) {
  std::vector<T> samples(std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]));
  for (T& v : samples) v = T(random());
  samples.front() = std::numeric_limits<T>::min();
  samples.back() = std::numeric_limits<T>::max();
  return testing::volume_of_type(type, dims, samples);
}

// Noise that needs a table: f64 of all magnitudes, of a few values, and integers of all 32 bits.
Volume noise(const Dims& dims, unsigned seed) {
  std::mt19937_64 random(seed);
  if (seed % 4 == 1) return whole_span<std::int32_t>(SampleType::i32, dims, random);
  if (seed % 4 == 2) return whole_span<std::uint32_t>(SampleType::u32, dims, random);
  std::vector<double> few(20), samples(std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]));
  for (double& v : few) v = wild_number(random);
  for (double& v : samples) v = seed % 4 == 3 ? few[random() % few.size()] : wild_number(random);
  return testing::volume_of_type(SampleType::f64, dims, samples);
}

class ExactValues : public ::testing::TestWithParam<unsigned> {
 public:
  static constexpr std::array<Dims, 4> kBoxes{{{9, 9, 9}, {9, 7, 5}, {17, 12, 13}, {6, 21, 4}}};

  [[nodiscard]] Range random_range() {
    const auto any = [&](int axis) { return std::int32_t(random() % std::uint32_t(field.volume.grid.dims[std::size_t(axis)])); };
    const double a = field.value({any(0), any(1), any(2)}), b = field.value({any(0), any(1), any(2)});
    return {std::min(a, b), std::max(a, b)};
  }

  // The mesh of a range at full detail equals that of the samples: its points, and their values.
  void expect_naive(const Extraction& extracted, const Range& range, const IntervalVolume& updates) const {
    const Mesh mesh = extracted.front.mesh();
    const auto is_split = [&](Vertex c) { return updates.set().find(c).has_value(); };
    EXPECT_EQ(testing::points_of(mesh, field.volume.grid), testing::naive_points(field.volume, range, is_split));
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      const auto& p = mesh.points[i];
      const double expected = mesh.surface[i] == Surface::alpha  ? range.alpha
                              : mesh.surface[i] == Surface::beta ? range.beta
                                                                 : field.value({std::int32_t(p[0]), std::int32_t(p[1]), std::int32_t(p[2])});
      ASSERT_EQ(mesh.value[i], expected);
    }
  }

  testing::ValueField field = [] {
    Volume volume = noise(kBoxes[GetParam() / 4 % 4], GetParam());
    ValueFormat format = choose_value_format(volume, 0.0).value();
    return testing::ValueField{std::move(volume), std::move(format)};
  }();
  std::mt19937 random{GetParam()};
};

TEST_P(ExactValues, AFileOfEveryRangeGivesBackAllSamples) {
  ASSERT_NE(field.format.table, nullptr);
  Volume samples = field.volume;
  const auto bytes = encode_values(build_value_volume(samples, field.format));
  const auto decoded = decode_values(bytes, "again");
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(encode_values(*decoded), bytes);
  const FieldDescription& d = decoded->description();
  EXPECT_TRUE(d.is_exact);
  EXPECT_EQ(d.format, field.format);
  decoded->set().for_each_down([&](const Place& p) { ASSERT_EQ(d.format.value(decoded->key(p.index)), field.value(SupercubeSet::centre(p))); });
  const Diamond root(field.domain.root());
  for (int v = 0; v < kRootVertices; ++v) EXPECT_EQ(d.format.value(d.corners[std::size_t(v)]), field.value(root.vertex(v)));
  std::uint64_t counted = 0;
  for (const std::uint64_t n : d.statistics.histogram.count) counted += n;
  EXPECT_EQ(counted, field.volume.grid.sample_count());
}

TEST_P(ExactValues, MeshesAreThoseOfTheSamplesInBothScopesAndThroughStreams) {
  Volume samples = field.volume;
  auto values = decode_values(encode_values(build_value_volume(samples, field.format)), "made");
  ASSERT_TRUE(values);
  const auto every = std::make_shared<const IntervalVolume>(of_every_range(std::move(*values).take()).value());
  ClientSession session({.dataset = "made", .client = "test"});
  testing::SessionServer server(every, session);
  for (int i = 0; i < 4; ++i) {
    const Range range = random_range();
    const Refine refine = random() % 2 == 0 ? Refine::boundary : Refine::uniform;
    SCOPED_TRACE(testing::text_of(range, refine));
    const auto built = FieldHierarchy(field.volume, {range, refine}).compact(field.format);
    ASSERT_TRUE(built) << built.error().message;
    const auto one = decode_ivm(encode_ivm(*built), "one");
    ASSERT_TRUE(one) << one.error().message;
    EXPECT_EQ(one->description(), [&] {
      Description d = built->description();
      d.name = "one";
      d.content_hash = one->description().content_hash;  // only a file has one
      return d;
    }());
    const auto expected = extract(*one, Lod{});
    ASSERT_TRUE(expected);
    expect_naive(*expected, range, *one);
    const auto digest = mesh_digest(expected->front.mesh());
    const auto extracted = extract(*every, *find_relevant_updates(every, {{range, refine}}, Distances::measured), {});
    ASSERT_TRUE(extracted);
    EXPECT_EQ(mesh_digest(extracted->front.mesh()), digest);
    ViewRequest view;
    view.shown = {{range}, refine};
    ASSERT_TRUE(session.look(view));
    server.run();
    EXPECT_EQ(mesh_digest(session.mesh()->mesh()), digest);
  }
}

TEST_P(ExactValues, DamagedFilesAreRefused) {
  if (field.volume.grid.sample_count() > 400) return;  // every byte takes a decoding
  Volume samples = field.volume;
  const auto every = encode_values(build_value_volume(samples, field.format));
  const auto one = encode_ivm(FieldHierarchy(field.volume, {random_range(), Refine::boundary}).compact(field.format).value());
  const auto is_refused = [](std::span<const std::byte> bytes, bool is_every) {
    return is_every ? !decode_values(bytes, "damaged") : !decode_ivm(bytes, "damaged");
  };
  for (const bool is_every : {false, true}) {
    const std::vector<std::byte>& bytes = is_every ? every : one;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      std::vector<std::byte> damaged = bytes;
      damaged[i] ^= std::byte(1 + random() % 255);
      ASSERT_TRUE(is_refused(damaged, is_every)) << "byte " << i;
      ASSERT_TRUE(is_refused(std::span(bytes).first(i), is_every)) << i << " bytes";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Random, ExactValues, testing::seeds(0, 16));

}  // namespace
}  // namespace intervale
