// Slabs of samples, and parts of volumes, of every format.
#include "server/volume/volume_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "server/volume/read_volume.h"
#include "tests/support/temp_dir.h"
#include "tests/support/volume_files.h"

namespace intervale {
namespace {

using testing::VolumeFile;

class Slabs : public ::testing::TestWithParam<std::size_t> {
 protected:
  [[nodiscard]] const VolumeFile& file() const { return testing::volume_files()[GetParam()]; }
  const TempDir folder_;
};

// The samples of a box, as a naive model takes them from the whole.
std::vector<std::byte> cut_out(const Volume& whole, const SampleBox& box) {
  const std::size_t sample = size_of(whole.type) * whole.components;
  const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    return whole.bytes.begin() + std::ptrdiff_t(sample * std::size_t((z * whole.grid.dims[1] + y) * whole.grid.dims[0] + x));
  };
  std::vector<std::byte> bytes;
  for (auto z = box.first[2]; z <= box.last[2]; ++z) {
    for (auto y = box.first[1]; y <= box.last[1]; ++y) {
      for (auto x = box.first[0]; x <= box.last[0]; ++x) bytes.insert(bytes.end(), at(x, y, z), at(x, y, z) + std::ptrdiff_t(sample));
    }
  }
  return bytes;
}

// All boxes of a volume of these dims.
std::vector<SampleBox> boxes_of(const std::array<std::int32_t, 3>& dims) {
  std::vector<SampleBox> boxes{SampleBox{}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<SampleBox> more;
    for (SampleBox box : boxes) {
      for (std::int64_t first = 0; first < dims[axis]; ++first) {
        for (std::int64_t last = first + 1; last < dims[axis]; ++last) {
          box.first[axis] = first;
          box.last[axis] = last;
          more.push_back(box);
        }
      }
    }
    boxes = more;
  }
  return boxes;
}

TEST_P(Slabs, OfAnySizeAreThoseOfTheWhole) {
  const auto path = folder_.file(file().name, file().bytes);
  std::mt19937 random(5);
  std::vector<std::byte> whole;
  for (int round = 0; round < 20; ++round) {
    const auto reader = open_volume(path, {}, file().time_point);
    ASSERT_TRUE(reader) << reader.error().message;
    const std::size_t number = size_of((*reader)->header().type), all = (*reader)->header().data_bytes();
    std::vector<std::byte> read(all);
    if (round == 0) {
      ASSERT_TRUE((*reader)->read(read));
      whole = read;
      continue;
    }
    for (std::size_t at = 0; at < all;) {
      const std::size_t step = std::min(all - at, number * (1 + random() % (all / number)));
      if (random() % 3 == 0) {
        ASSERT_TRUE((*reader)->skip(step));
        std::copy_n(whole.begin() + std::ptrdiff_t(at), step, read.begin() + std::ptrdiff_t(at));
      } else {
        ASSERT_TRUE((*reader)->read(std::span(read).subspan(at, step)));
      }
      at += step;
    }
    EXPECT_EQ(read, whole);
  }
}

TEST_P(Slabs, CroppedVolumesHaveTheSamplesOfTheWholeWhereTheyAre) {
  const auto path = folder_.file(file().name, file().bytes);
  const auto whole = read_volume(path, {}, file().time_point);
  ASSERT_TRUE(whole) << whole.error().message;
  for (const SampleBox& box : boxes_of(whole->grid.dims)) {
    const auto part = read_volume(path, {}, file().time_point, {}, box);
    ASSERT_TRUE(part) << part.error().message;
    if (part->type == whole->type) {
      EXPECT_EQ(part->bytes, cut_out(*whole, box));
    }
    const Vec3 first{double(box.first[0]), double(box.first[1]), double(box.first[2])};
    const Vec3 before = whole->grid.affine.point(first), after = part->grid.affine.origin();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(part->grid.dims[axis], box.last[axis] - box.first[axis] + 1);
      EXPECT_NEAR(after[axis], before[axis], 1e-12);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Slabs, ::testing::Range<std::size_t>(0, testing::volume_files().size()), [](const auto& number) {
  std::string name = testing::volume_files()[number.param].name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

TEST(CroppedVolumes, KeepOnlyWhatIsChosenInMemory) {
  const TempDir folder;
  const auto path = folder.file("large.raw", "");
  constexpr std::int64_t kSide = 1 << 16, kSlices = 16;
  std::filesystem::resize_file(path, kSide * kSide * kSlices);  // 64 GiB, of which the disk has nothing
  std::fstream(path, std::ios::in | std::ios::out).seekp(kSide * kSide * (kSlices - 1) + kSide * 5 + 7).put('x');
  const RawLayout layout{{kSide, kSide, kSlices}, SampleType::u8};
  const auto part = read_volume(path, layout, {}, {}, SampleBox{{6, 5, kSlices - 2}, {8, 6, kSlices - 1}});
  ASSERT_TRUE(part) << part.error().message;
  std::vector<std::byte> expected(12);
  expected[7] = std::byte('x');
  EXPECT_EQ(part->bytes, expected);
}

TEST(CroppedVolumes, AreWithinTheWhole) {
  const TempDir folder;
  const auto path = folder.file("v.raw", std::string(60, 'x'));
  const RawLayout layout{{3, 4, 5}, SampleType::u8};
  const auto crop = [&](std::array<std::int64_t, 3> first, std::array<std::int64_t, 3> last) {
    return read_volume(path, layout, {}, {}, SampleBox{first, last});
  };
  EXPECT_TRUE(crop({0, 0, 0}, {2, 3, 4}));
  for (const auto& part : {crop({-1, 0, 0}, {2, 3, 4}), crop({0, 0, 0}, {2, 4, 4}), crop({0, 0, 4}, {2, 3, 4}), crop({0, 3, 0}, {2, 1, 4}),
                           crop({0, 0, INT64_MIN}, {2, 3, INT64_MAX})}) {
    ASSERT_FALSE(part);
    EXPECT_TRUE(part.error().usage);
  }
}

// Three samples on each axis; four numbers of each, which are 4 i to 4 i + 3.
std::string with_components(const std::string& fields) {
  std::string bytes = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 4 3 3 3\n" + fields + "encoding: raw\n\n";
  for (int i = 0; i < 4 * 27; ++i) bytes += char(i);
  return bytes;
}

TEST(Components, OneOfSeveralIsChosen) {
  const TempDir folder;
  for (const char* fields : {"kinds: list domain domain domain\n", "kinds: 4-vector space space space\n",
                             "space: RAS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"}) {
    const auto path = folder.file("v.nrrd", with_components(fields));
    const auto unchosen = read_volume(path, {});
    ASSERT_FALSE(unchosen);
    EXPECT_TRUE(unchosen.error().usage);
    EXPECT_NE(unchosen.error().message.find("4 numbers a sample: choose one, 0 to 3"), std::string::npos) << unchosen.error().message;
    for (int component = 0; component < 4; ++component) {
      const auto volume = read_volume(path, {}, {}, std::to_string(component), SampleBox{{1, 0, 1}, {2, 2, 2}});
      ASSERT_TRUE(volume) << volume.error().message;
      EXPECT_EQ(volume->components, 1u);
      std::vector<std::byte> expected;
      for (int i : {10, 11, 13, 14, 16, 17, 19, 20, 22, 23, 25, 26}) expected.push_back(std::byte(4 * i + component));
      EXPECT_EQ(volume->bytes, expected);
    }
    for (const char* part : {"4", "-1", "x", ""}) EXPECT_FALSE(read_volume(path, {}, {}, part)) << part;
  }
}

TEST(Components, TimePointsAreParts) {
  const TempDir folder;
  std::string bytes = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 2 2 5\nkinds: domain domain domain list\nencoding: raw\n\n";
  for (int i = 0; i < 40; ++i) bytes += char(i);
  const auto path = folder.file("v.nrrd", bytes);
  const auto volume = read_volume(path, {}, {}, "/3");
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->bytes.front(), std::byte(24));
  EXPECT_FALSE(read_volume(path, {}, {}, "5"));
}

}  // namespace
}  // namespace intervale
