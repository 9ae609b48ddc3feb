// What is left of files with damaged pages: right values only, and meshes without a crack.
#include "common/ivm/page_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/mesh/mesh_digest.h"
#include "common/parallel/all_cores.h"
#include "common/ranges/find_relevant_updates.h"
#include "server/builder/value_builder.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/needs.h"
#include "tests/support/page_damage.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using Shared = std::shared_ptr<const IntervalVolume>;

// Smooth: large volumes have small meshes.
Volume waves(const testing::Dims& dims) {
  std::vector<std::uint8_t> f;
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) f.push_back(std::uint8_t(100 + 30 * std::sin(x / 9.0) + 30 * std::cos(y / 8.0) + 30 * std::sin(z / 7.0)));
    }
  }
  return testing::volume_of_type(SampleType::u8, dims, f);
}

std::vector<std::byte> file_of_every_range(const testing::Dims& dims) {
  testing::ValueField field = testing::value_field(waves(dims), 1);
  return encode_values(build_value_volume(field.volume, field.format), on_all_cores);
}

std::vector<std::byte> file_of_one_range(const testing::Dims& dims) {
  return encode_ivm(testing::build(waves(dims), {.range = {40, 160}, .refine = Refine::uniform}), on_all_cores);
}

Shared decoded(const std::vector<std::byte>& file, PageFaults* faults) {
  auto volume = decode_volume(file, "volume", on_all_cores, kAnyRoom, faults);
  EXPECT_TRUE(volume) << volume.error().message;
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

// All of the update's values are those of the whole volume, and so are its parents'.
void expect_right_values(const IntervalVolume& left, const IntervalVolume& whole) {
  const SupercubeSet& set = left.set();
  std::uint64_t count = 0;
  set.for_each_down([&](const Place& p) {
    const auto has = [&](const Place& q) { return (left.left(q.supercube) >> unsigned(q.slot) & 1U) != 0; };
    if (!has(p)) return;
    ++count;
    ASSERT_EQ(left.key(p.index), whole.key(p.index));
    const Diamond d(SupercubeSet::centre(p));
    for (int k = 0; k < d.row->parents; ++k) {
      const Vertex q = d.parent(k);
      if (left.domain().clamp(q) != q && left.domain().tets(Diamond(q)) == 0) continue;
      const auto parent = set.find(q);
      ASSERT_TRUE(!parent || has(*parent));
    }
  });
  EXPECT_EQ(count, left.size() - left.lost_updates());
}

// The mesh does not depend on what is lost: it is that of the whole volume's updates, less the lost ones.
void expect_mesh_of_what_is_left(const Shared& left, const Shared& whole, const ShownRange& shown) {
  const auto relevant = find_relevant_updates(left, {shown}, Distances::none, on_all_cores);
  const auto mesh = extract(*left, *relevant, {shown}, {}, on_all_cores);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->front().front.validate(), std::nullopt);
  const auto all = find_relevant_updates(whole, {shown}, Distances::none, on_all_cores);
  std::vector<std::uint64_t> slots;
  const auto of_all = testing::slots_of(*all, *whole);
  for (SupercubeIndex s{0}; s < of_all.size(); ++s) slots.push_back(of_all[s] & left->left(s));
  const RelevantUpdates expected(whole->description().grid, whole->set(), {whole->steps(), whole->error_steps()}, {shown}, slots,
                                 {std::vector<ErrorToDistance>(whole->set().supercubes())});
  const auto other = extract(*whole, expected, {shown}, {}, on_all_cores);
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(mesh_digest(mesh->front().front.mesh()), mesh_digest(other->front().front.mesh()));
}

void expect_what_is_left(const std::vector<std::byte>& file, std::size_t page, int scale, const ShownRange& shown) {
  const Shared whole = decoded(file, nullptr);
  std::vector<std::byte> damaged = file;
  testing::damage_page(damaged, page);
  const auto refused = decode_volume(damaged, "damaged", on_all_cores);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("page " + std::to_string(page) + " of "));
  PageFaults faults;
  const Shared left = decoded(damaged, &faults);
  ASSERT_EQ(faults.damaged.size(), 1u);
  EXPECT_EQ(faults.damaged[0].number, page);
  EXPECT_EQ(faults.damaged[0].scale, scale);
  EXPECT_EQ(faults.lost_updates, left->lost_updates());
  EXPECT_GT(left->lost_updates(), 0u);
  EXPECT_NE(left->description().content_hash, whole->description().content_hash);
  expect_right_values(*left, *whole);
  expect_mesh_of_what_is_left(left, whole, shown);
}

TEST(PageFaults, OfEveryRangeTheRestHasTheRightMeshes) {
  const std::vector<std::byte> file = file_of_every_range({81, 97, 40});
  const std::size_t pages = testing::page_count(file);
  ASSERT_GT(pages, 2u);
  expect_what_is_left(file, pages - 1, 0, {{90, 120}, Refine::boundary});
  expect_what_is_left(file, 1, 0, {{60, 70}, Refine::uniform});
}

TEST(PageFaults, OfOneRangeTheRestHasTheRightMesh) {
  const std::vector<std::byte> file = file_of_one_range({81, 97, 70});
  ASSERT_GT(testing::page_count(file), 2u);
  expect_what_is_left(file, 1, 0, {{40, 160}, Refine::uniform});
}

TEST(PageFaults, ADamagedCoarsePageTakesTheFinerOnesAlongThatNeedIt) {
  const std::vector<std::byte> file = file_of_every_range({132, 130, 131});
  std::vector<std::byte> damaged = file;
  testing::damage_page(damaged, 1);
  PageFaults faults;
  const Shared left = decoded(damaged, &faults);
  ASSERT_EQ(faults.damaged.size(), 1u);
  EXPECT_EQ(faults.damaged[0].scale, 1);
  EXPECT_GT(std::count(faults.lost.begin(), faults.lost.end(), true), 1);
  EXPECT_LT(left->lost_updates(), left->size());
  expect_right_values(*left, *decoded(file, nullptr));
}

TEST(PageFaults, NothingIsLostOfAFileInOrder) {
  const std::vector<std::byte> file = file_of_every_range({17, 12, 33});
  PageFaults faults;
  const Shared volume = decoded(file, &faults);
  EXPECT_FALSE(faults.any());
  EXPECT_EQ(volume->lost_updates(), 0u);
  EXPECT_EQ(volume->description(), decoded(file, nullptr)->description());
}

TEST(PageFaults, TheFirstPageIsNeededByAll) {
  std::vector<std::byte> file = file_of_every_range({17, 12, 33});
  testing::damage_page(file, 0);
  PageFaults faults;
  const auto volume = decode_volume(file, "damaged", on_all_cores, kAnyRoom, &faults);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("page 0 of 1 (scale 0, samples (0, 0, 0) to (16, 11, 32)) is damaged"));
}

}  // namespace
}  // namespace intervale
