// The beginning of a file is the data set as far as to some scale.
#include "common/ivm/coarse_scales.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "client/local/fetch_local.h"
#include "common/ivm/distance_codes.h"
#include "common/ivm/extraction.h"
#include "common/ivm/load_volume.h"
#include "common/mesh/mesh_digest.h"
#include "common/parallel/all_cores.h"
#include "common/ranges/extract_meshes.h"
#include "common/view/screen_error.h"
#include "tests/support/coarse_files.h"
#include "tests/support/seeds.h"
#include "tests/support/value_fields.h"

namespace intervale::coarse_files {
namespace {

TEST(CoarseScales, AreTheSameUpdatesAsThoseOfTheWholeFile) {
  for (const auto& made : std::span(kFiles).first(testing::cases(kFiles.size()))) {
    const Bytes file = std::apply(file_of, made);
    const SharedVolume all = whole(file);
    EXPECT_TRUE(all->is_whole());
    std::size_t before = 0;
    for (const CoarseScales& scales : scales_of(file)) {
      const SharedVolume some = coarse(file, scales);
      EXPECT_FALSE(some->is_whole());
      EXPECT_GT(some->size(), before);
      before = some->size();
      EXPECT_EQ(some->description(), all->description());
      ASSERT_LE(some->set().supercubes(), all->set().supercubes());
      EXPECT_TRUE(std::ranges::equal(some->set().occupancy(), all->set().occupancy().first(some->set().supercubes())));
      for (UpdateIndex i{0}; i < some->size(); ++i) {
        ASSERT_EQ(some->key(i), all->key(i));
        ASSERT_EQ(some->error(i), all->error(i));
      }
      EXPECT_EQ(some->set().of_scale(scales.finest - 1)[0], some->set().bricks().size()) << "no finer scales";
    }
    EXPECT_GT(before, 0U);
  }
}

TEST(CoarseScales, TheirMeshIsThatOfTheWholeFileWhereNothingFinerIsWanted) {
  const SharedVolume all = whole(large());
  for (const CoarseScales& scales : scales_of(large())) {
    const SharedVolume some = coarse(large(), scales);
    Lod lod;
    for (UpdateIndex i{some->size()}; i < all->size(); ++i) lod.error = std::max(lod.error, double(all->error(i)));
    const ShownRanges shown{{{-0.4, 0.3}, Refine::boundary}};
    const auto one = extract_meshes(some, shown, lod, {}, on_all_cores), other = extract_meshes(all, shown, lod, {}, on_all_cores);
    ASSERT_TRUE(one && other);
    EXPECT_GT((*one)[0].mesh.tets.size(), 0U);
    EXPECT_EQ(mesh_digest((*one)[0].mesh), mesh_digest((*other)[0].mesh));
  }
}

// The largest error of a scale's last level bounds those of all finer scales, whatever the box cuts.
TEST(CoarseScales, ErrorsOfTheLastLevelOfAScaleBoundThoseOfFinerOnes) {
  for (const Dims& dims :
       std::vector<Dims>{{33, 33, 33}, {40, 21, 35}, {70, 67, 66}, {65, 9, 30}, {2, 50, 7}, {37, 2, 2}, {18, 17, 100}, {3, 3, 66}}) {
    for (unsigned seed = 0; seed < testing::cases(5); ++seed) {
      const SharedVolume all = whole(file_of(dims, seed));
      const SupercubeSet& set = all->set();
      const auto largest = [&](int scale, int cls) {
        double error = 0;
        set.for_each(scale, cls, [&](const Place& p) { error = std::max(error, double(all->error(p.index))); });
        return error;
      };
      double finer = 0;
      for (int scale = 0; scale < all->domain().levels(); ++scale) {
        for (const int cls : {2, 1, 0}) {
          EXPECT_GE(largest(scale, cls), finer) << dims[0] << "x" << dims[1] << "x" << dims[2] << " field " << seed << " scale " << scale << " level "
                                                << cls;
          finer = std::max(finer, largest(scale, cls));
        }
      }
    }
  }
}

TEST(CoarseScales, WantFinerOnesWhereTheirErrorsAreAboveTheThreshold) {
  for (const auto& made : std::span(kFiles).first(testing::cases(kFiles.size()))) {
    const Bytes file = std::apply(file_of, made);
    const SharedVolume all = whole(file);
    EXPECT_FALSE(wants_finer(*all, {}));
    for (const CoarseScales& scales : scales_of(file)) {
      const SharedVolume some = coarse(file, scales);
      EXPECT_TRUE(wants_finer(*some, {})) << "error 0 wants all";
      EXPECT_FALSE(wants_finer(*some, {.error_percent = 100}));
      EXPECT_TRUE(wants_finer(*some, {.error_percent = 100, .camera = Camera{}})) << "distances need the whole data set";
      for (const float step : all->error_steps()) {
        bool is_finer_wanted = false, is_last_level_above = false;
        for (UpdateIndex i{some->size()}; i < all->size(); ++i) is_finer_wanted = is_finer_wanted || all->error(i) > step;
        some->set().for_each(scales.finest, 2, [&](const Place& p) { is_last_level_above = is_last_level_above || some->error(p.index) > step; });
        if (step > 0) {
          EXPECT_EQ(wants_finer(*some, {.error = step}), is_last_level_above);
        }
        EXPECT_TRUE(wants_finer(*some, {.error = step}) || !is_finer_wanted) << "error " << step;
      }
    }
  }
}

// A camera wants no scale of whose diamonds half the width is within its pixel error, wherever they are.
TEST(CoarseScales, EstimatesWantFinerOnesWhereTheirDiamondsAreLargeOnTheScreen) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-200, 300), within(0, 1);
  for (const auto& made : std::span(kFiles).first(testing::cases(kFiles.size()))) {
    const Bytes file = std::apply(file_of, made);
    const SharedVolume all = whole(file);
    const Grid& grid = all->description().grid;
    const Box box = box_of(grid);
    for (const CoarseScales& scales : scales_of(file)) {
      const SharedVolume some = coarse(file, scales);
      const double half_width = std::ldexp(diamond_width(grid), scales.finest - 1) / 2;
      int wanting = 0;
      for (int i = 0; i < 200; ++i) {
        Lod lod;
        lod.camera = Camera{.eye = {anywhere(random), anywhere(random), anywhere(random)}, .look_at = {33, 30, 10}, .viewport = {640, 480}};
        lod.camera->pixel_error = std::exp(8 * within(random) - 2);
        EXPECT_FALSE(estimates_want_finer(*all, lod));
        const bool is_wanted = estimates_want_finer(*some, lod);
        wanting += int(is_wanted);
        EXPECT_FALSE(estimates_want_finer(*some, {.error_percent = 100, .camera = lod.camera})) << "the error is enough";
        Lod finer = lod;
        finer.camera->pixel_error /= 2;
        EXPECT_TRUE(!is_wanted || estimates_want_finer(*some, finer));
        if (is_wanted) continue;
        const ScreenError screen(*lod.camera, grid);
        for (int point = 0; point < 50; ++point) {
          ScreenError::Region region;
          for (std::size_t axis = 0; axis < 3; ++axis) region.middle[axis] = within(random) * double(grid.dims[axis] - 1);
          EXPECT_LE(half_width * screen.pixels_per_unit(region), lod.camera->pixel_error);
        }
      }
      EXPECT_GT(wanting, 20);
      EXPECT_LT(wanting, 180);
      EXPECT_EQ(estimates_want_finer(*some, {.roi = box}), wants_finer(*some, {.roi = box}));
      EXPECT_EQ(estimates_want_finer(*some, {.error_percent = 40}), wants_finer(*some, {.error_percent = 40}));
    }
  }
}

// Any range, refined in any way: what finer values make relevant besides is not shown.
TEST(CoarseScales, EndAFetchOnceNothingFinerIsWanted) {
  std::mt19937 random(3);
  std::size_t ended = 0;
  constexpr std::array kSeeds{0U, 1U, 2U, 4U};
  for (const unsigned seed : std::span(kSeeds).first(testing::cases(kSeeds.size()))) {
    const Dims dims{70, 67, 66};
    const testing::ValueField field = testing::random_value_field(dims, seed);
    const Bytes file = file_of(dims, seed);
    const SharedVolume all = whole(file), some = coarse(file, scales_of(file).front());
    double least = 0;  // threshold
    some->set().for_each(scales_of(file).front().finest, 2, [&](const Place& p) { least = std::max(least, double(some->error(p.index))); });
    for (int n = 0; n < 6; ++n) {
      FetchOptions options;
      options.lod.error = n % 3 == 0 ? least : n % 3 == 1 ? least * 1.3 : least / 2;
      options.shown = {{testing::random_range(field, random)}, n % 4 == 1 ? Refine::uniform : Refine::boundary};
      if (n % 5 == 0) options.shown.ranges.push_back(testing::random_range(field, random));
      bool is_whole = false;
      const auto read = [&](ReadOn how, const ParallelFor&) -> Result<SharedVolume> {
        EXPECT_EQ(how, ReadOn::one_scale);
        return std::exchange(is_whole, true) ? all : some;
      };
      int reads = 0;
      const auto growing =
          fetch_growing([&](ReadOn how, const ParallelFor& parallel) { return ++reads, read(how, parallel); }, options, {}, on_all_cores);
      const auto at_once = fetch_local(all, options, {});
      ASSERT_TRUE(growing && at_once);
      EXPECT_TRUE(growing->stats.is_complete);
      EXPECT_EQ(reads, wants_finer(*some, options.lod) ? 2 : 1);
      ended += reads == 1 ? 1 : 0;
      const auto one = growing->client.meshes(), other = at_once->client.meshes();
      ASSERT_EQ(one.size(), other.size());
      for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(mesh_digest(one[i]), mesh_digest(other[i])) << seed << " " << n;
      EXPECT_EQ(growing->client.updates_in_mesh(), at_once->client.updates_in_mesh());
    }
  }
  EXPECT_GT(ended, 2 * testing::cases(4));
}

TEST(CoarseScales, AreFewOfTheBytes) {
  const std::vector<CoarseScales> scales = scales_of(large());
  ASSERT_EQ(scales.size(), 2U);
  EXPECT_LT(scales[0].first_bytes + scales[0].last_bytes, large().size() / 20);
  EXPECT_LT(scales[1].first_bytes + scales[1].last_bytes, large().size() / 4);
  EXPECT_TRUE(scales_of(file_of({9, 7, 5}, 0)).empty()) << "a single page";
}

TEST(CoarseScales, TellHowMuchMemoryTheyTake) {
  const Bytes file = file_of({134, 130, 129}, 3);
  const auto decode = [&](std::uint64_t room) { return decode_volume(file, "made", serial, room); };
  const Description d = whole(file)->description();
  const std::uint64_t all = memory_to_decode(d.grid, d.format.last);
  EXPECT_TRUE(decode(all));
  EXPECT_THROW((void)decode(all - 1), NoRoom);
  EXPECT_GE(all, whole(file)->memory_bytes());
  for (const CoarseScales& scales : scales_of(file)) {
    const std::uint64_t some = memory_to_decode(d.grid, d.format.last, scales.finest);
    EXPECT_GE(some, coarse(file, scales)->memory_bytes());
    EXPECT_LT(some, all / 6);
  }
}

TEST(CoarseScales, NeedTheIndexOfThePages) {
  const auto scales = scales_of(large());
  const auto index = place_of(StreamType::page_index, large(), large().size(), FileScope::every_range).value();
  const std::uint64_t end = index.offset + index.bytes;
  for (const std::size_t there : {std::size_t(400), std::size_t(end) - 1, std::size_t(end), kStartBytes}) {
    const auto start = std::span(large()).first(there);
    EXPECT_EQ(start_bytes(start, large().size()), std::max<std::uint64_t>(end, there));
    const auto found = coarse_scales(start, large().size());
    ASSERT_TRUE(found);
    EXPECT_EQ(found->size(), there < end ? 0 : scales.size());
  }
  Bytes damaged = large();
  damaged[100] ^= std::byte(1);
  EXPECT_EQ(start_bytes(std::span(damaged).first(400), damaged.size()), 400U);
}

TEST(CoarseScales, RefuseWhatIsDamagedCutShortOrNoFile) {
  const Bytes file = file_of({70, 67, 66}, 0);
  const CoarseScales scales = scales_of(file).front();
  for (std::size_t i = 0; i < scales.first_bytes; i += i < 700 ? 3 : 1997) {
    Bytes changed = file;
    changed[i] ^= std::byte(1 << i % 8);
    EXPECT_FALSE(decode_coarse(ends_of(changed, scales), scales, "changed")) << "byte " << i;
  }
  for (std::size_t i = 1; i <= scales.last_bytes; i += 5) {
    Bytes changed = file;
    changed[file.size() - i] ^= std::byte(1);
    EXPECT_FALSE(decode_coarse(ends_of(changed, scales), scales, "changed")) << "byte " << i << " from the end";
  }
  CoarseScales less = scales;
  --less.first_bytes;
  EXPECT_FALSE(decode_coarse(ends_of(file, less), scales, "short"));
  less = scales;
  --less.last_bytes;
  EXPECT_FALSE(decode_coarse(ends_of(file, less), scales, "short"));
  EXPECT_FALSE(decode_coarse({std::span(file), std::span(file), file.size()}, scales, "long"));
  EXPECT_FALSE(coarse_scales(std::span(file).first(kStartBytes), file.size() - 1));
  EXPECT_FALSE(coarse_scales(std::span(file).first(20), file.size()));
  EXPECT_FALSE(coarse_scales({}, 0));
  EXPECT_TRUE(scales_of(Bytes(file.begin(), file.end())).size() == 1);
  const auto within = coarse_scales(std::span(file).first(600), file.size());
  EXPECT_TRUE(within && within->empty()) << "the index is not there";
}

}  // namespace
}  // namespace intervale::coarse_files
