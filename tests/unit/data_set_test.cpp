// Data sets as programs that embed the builder library have them.
#include "server/api/build.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "common/ivm/ivm_file.h"
#include "common/ivm/load_volume.h"
#include "common/mesh/mesh_digest.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/channels.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

constexpr std::array<std::int32_t, 3> kDims{19, 14, 17};

MeshRequest shown(std::vector<Range> ranges) {
  MeshRequest request;
  request.shown.ranges = std::move(ranges);
  return request;
}

template <class T>
void expect_misuse(const Result<T>& result, const char* text) {
  ASSERT_FALSE(result) << text;
  EXPECT_TRUE(result.error().usage) << result.error().message;
  EXPECT_THAT(result.error().message, HasSubstr(text));
}

std::vector<std::byte> bytes_of(const std::filesystem::path& path) {
  auto bytes = read_volume_file(path);
  EXPECT_TRUE(bytes) << path;
  return bytes.value_or(std::vector<std::byte>());
}

TEST(DataSet, OfOneRangeIsTheIntervalVolumeOfThatRange) {
  const Volume volume = testing::digits(kDims, 5);
  const IntervalVolume expected = testing::build(volume, {.range = {3, 5.5}});
  const auto made = build_data_set(volume, {.range = Range{3, 5.5}});
  ASSERT_TRUE(made) << made.error().message;
  const TempDir folder;
  ASSERT_TRUE(made->save(folder / "made.ivm"));
  EXPECT_EQ(bytes_of(folder / "made.ivm"), encode_ivm(expected));
  EXPECT_EQ(made->info().updates, expected.size());
  EXPECT_EQ(made->info().shown, (ShownRange{{3, 5.5}, Refine::boundary}));
  const auto mesh = made->extract();
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->tets.size(), made->info().tets);
  EXPECT_FALSE(made->histogram() || made->enclosed_volume({3, 4}));
  expect_misuse(made->extract(shown({{1, 2}})), "alone");
}

TEST(DataSet, OfEveryRangeHasTheMeshesOfDataSetsOfEachRange) {
  const Volume volume = testing::stretched(testing::digits(kDims, 6));
  const auto every = build_data_set(volume);
  ASSERT_TRUE(every) << every.error().message;
  EXPECT_FALSE(every->info().shown);
  EXPECT_EQ(every->info().tets, 0u);
  for (const Range& range : {Range{3, 5.5}, Range{-std::numeric_limits<double>::infinity(), 2}, Range{4, 4}}) {
    const auto one = build_data_set(volume, {.range = range});
    ASSERT_TRUE(one);
    const auto mesh = every->extract(shown({range})), expected = one->extract();
    ASSERT_TRUE(mesh && expected);
    EXPECT_EQ(mesh_digest(*mesh), mesh_digest(*expected));
    EXPECT_NEAR(*every->enclosed_volume(range), volume_of(*mesh), 0.001 * volume_of(*every->extract(shown({{-9, 99}}))));
  }
}

TEST(DataSet, SavedOpenedAndSavedAgainIsTheSame) {
  const TempDir folder;
  const Volume volume = testing::gyroid(kDims);
  for (const std::optional<Range>& range : {std::optional<Range>(), std::optional(Range{-0.3, 0.2})}) {
    const auto made = build_data_set(volume, {.range = range});
    ASSERT_TRUE(made && made->save(folder / "first.ivm"));
    const auto opened = DataSet::open(folder / "first.ivm");
    ASSERT_TRUE(opened) << opened.error().message;
    ASSERT_TRUE(opened->save(folder / "second.ivm"));
    EXPECT_EQ(bytes_of(folder / "first.ivm"), bytes_of(folder / "second.ivm"));
    const MeshRequest request = shown({{-0.3, 0.2}});
    EXPECT_EQ(mesh_digest(*opened->extract(request)), mesh_digest(*made->extract(request)));
    const auto decoded = DataSet::decode(bytes_of(folder / "first.ivm"), "other");
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->info().name, "other");
    EXPECT_EQ(decoded->info().updates, made->info().updates);
    EXPECT_EQ(decoded->info().values, made->info().values);
  }
  EXPECT_FALSE(DataSet::open(folder / "none.ivm"));
  EXPECT_FALSE(DataSet::decode(std::vector<std::byte>(100), "nothing"));
}

TEST(DataSet, BringsChannelsAndPartsAlong) {
  DataSetOptions options;
  options.channels = {{.name = "flow", .volume = testing::noise(kDims, 3, 50, 1)}, {.name = "heat", .volume = testing::noise(kDims, 1, 50, 2)}};
  const auto made = build_data_set(testing::gyroid(kDims), options);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->info().channels.size(), 2u);
  EXPECT_EQ(made->info().channels[0].components, 3u);
  MeshRequest request = shown({{-0.3, 0.2}, {0.5, 1}});
  request.channels = {"flow"};
  const auto mesh = made->extract(request);
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->channels.size(), 1u);
  EXPECT_EQ(mesh->channels[0].value.size(), 3 * mesh->points.size());
  EXPECT_EQ(mesh->part.size(), mesh->tets.size());
  EXPECT_EQ(mesh->value.size(), mesh->points.size());
  request.channels = {"wind"};
  expect_misuse(made->extract(request), "wind");
}

TEST(DataSet, RefusesWhatItCannotBuildOrExtract) {
  const Volume volume = testing::gyroid(kDims);
  expect_misuse(build_data_set(volume, {.range = Range{2, 1}}), "LO <= HI");
  expect_misuse(build_data_set(volume, {.refine = Refine::uniform}), "with a range");
  expect_misuse(build_data_set(volume, {.step = -1}), "step");
  Volume cut = volume;
  cut.bytes.pop_back();
  expect_misuse(build_data_set(cut), "bytes");
  Volume flat = volume;
  flat.grid.dims[1] = 1;
  EXPECT_FALSE(build_data_set(flat));
  expect_misuse(build_data_set(testing::noise(kDims, 3, 9, 1)), "vectors");
  DataSetOptions options;
  options.channels = {{.name = "value", .volume = volume}};
  EXPECT_FALSE(build_data_set(volume, options));
  options.channels = {{.name = "heat", .volume = testing::gyroid({5, 5, 5})}};
  EXPECT_FALSE(build_data_set(volume, options));
  Volume hole = volume;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(hole.bytes.data() + 40, &nan, sizeof nan);
  EXPECT_FALSE(build_data_set(hole));
  EXPECT_TRUE(build_data_set(hole, {.nan = 0}));

  const auto every = build_data_set(volume);
  ASSERT_TRUE(every);
  expect_misuse(every->extract(), "every range");
  expect_misuse(every->extract(shown({{1, 0}})), "LO <= HI");
  expect_misuse(every->extract(shown({{std::nan(""), 0}})), "LO <= HI");
  expect_misuse(every->extract(shown({{0, 1}, {0, 1}, {0, 1}, {0, 1}, {0, 1}})), "at most 4");
  MeshRequest request = shown({{0, 1}});
  request.lod.error = -1;
  expect_misuse(every->extract(request), "error");
}

}  // namespace
}  // namespace intervale
