#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>

#include "common/patch/visit_samples.h"
#include "server/volume/nrrd.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"
#include "tests/support/affines.h"
#include "tests/support/temp_dir.h"
#include "tests/support/volume_files.h"

// teem forgets 88 bytes whenever a header is consistent line by line but not as a whole. Ours are still watched.
extern "C" [[gnu::visibility("default")]] const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libteem"; }

namespace intervale {
namespace {

namespace fs = std::filesystem;

const std::string kSizes = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 2 4\n";
const std::string kSamples = "abcdefghijklmnopqrstuvwx";

std::string bytes_of(const Volume& volume) { return {reinterpret_cast<const char*>(volume.bytes.data()), volume.bytes.size()}; }

std::string gzip(const std::string& text) { return testing::deflated(text, testing::Wrapping::gzip); }

void expect_samples(const Result<Volume>& volume) {
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.dims, (std::array<std::int32_t, 3>{3, 2, 4}));
  EXPECT_EQ(bytes_of(*volume), kSamples);
}

// Refused in one line that names the file and holds `part`.
void expect_refused(const Result<Volume>& volume, const std::string& part) {
  ASSERT_FALSE(volume);
  EXPECT_NE(volume.error().message.find(part), std::string::npos) << volume.error().message;
  EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
}

TEST(Nrrd, WhatIsWrittenIsReadBack) {
  const TempDir folder;
  std::mt19937 random(1);
  for (const auto type :
       {SampleType::u8, SampleType::i8, SampleType::u16, SampleType::i16, SampleType::u32, SampleType::i32, SampleType::f32, SampleType::f64}) {
    Volume volume{"v", {{5, 2, 3}, Affine::of({0.1, 1.0 / 3, 1e-7}, {-1.1, 0, 12345.678901234567})}, type, {}};
    volume.bytes.resize(volume.grid.sample_count() * size_of(type));
    for (auto& byte : volume.bytes) byte = static_cast<std::byte>(random());
    ASSERT_TRUE(write_nrrd(folder / "v.nrrd", volume));
    const auto read = read_nrrd(folder / "v.nrrd");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->name, "v");
    EXPECT_EQ(read->type, type);
    EXPECT_EQ(read->grid, volume.grid);
    EXPECT_EQ(read->bytes, volume.bytes);
  }
}

TEST(Nrrd, DirectionsAndLabelsComeBack) {
  const TempDir folder;
  std::mt19937 random(2);
  for (unsigned kind = 0; kind < 50; ++kind) {
    Volume volume{"v", {{5, 2, 3}, testing::random_affine(random, kind % 5)}, SampleType::u8, {}};
    volume.labels = {"mm", "CT \"head\"", "a\\b \u00b5", std::array{"", "RAS", "LAS", "LPS"}[kind % 4]};
    volume.bytes.resize(volume.grid.sample_count());
    ASSERT_TRUE(write_nrrd(folder / "v.nrrd", volume));
    const auto read = read_nrrd(folder / "v.nrrd");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->grid, volume.grid);
    EXPECT_EQ(read->labels, volume.labels);
  }
}

TEST(Nrrd, LabelsThatCannotBeAreIgnored) {
  const TempDir folder;
  const auto labels = [&](const std::string& fields) {
    const auto volume = read_nrrd(folder.file("v.nrrd", kSizes + fields + "encoding: raw\n\n" + kSamples));
    EXPECT_TRUE(volume) << volume.error().message;
    return volume ? volume->labels : Labels{};
  };
  EXPECT_EQ(labels("space dimension: 3\nspace units: \"mm\" \"mm\" \"mm\"\ncontent:  a head \nsample units: HU\n"), (Labels{"mm", "a head", "HU"}));
  const std::string directions = "space directions: (1,0,0) (0,1,0) (0,0,1)\n";
  EXPECT_EQ(labels("space: left-posterior-superior\n" + directions), (Labels{"", "", "", "LPS"}));
  EXPECT_EQ(labels("space: left-posterior-superior\n"), Labels{}) << "no axis lies in it";
  EXPECT_EQ(labels("space dimension: 3\nspace units: \"mm\" \"mm\" \"m\"\n"), Labels{}) << "they differ";
  EXPECT_EQ(labels("content: " + std::string(65, 'x') + "\nsample units: \xff\n"), Labels{});
  EXPECT_EQ(labels("content: \x1b[2J\nsample units: \"unfinished\n"), Labels{});
}

TEST(Nrrd, RefusesDirectionsThatAreNoAffine) {
  const TempDir folder;
  const auto read = [&](const std::string& fields) {
    return read_nrrd(folder.file("v.nrrd", kSizes + "space dimension: 3\n" + fields + "encoding: raw\n\n" + kSamples));
  };
  expect_refused(read("space directions: (2,0,0) (0,3,4) none\n"), "2 of 3 axes");
  expect_refused(read("space directions: (1,0,0) (0,1,0) (1,1,0)\n"), "singular");
  expect_refused(read("space directions: (1,0,0) (0,0,0) (0,0,1)\n"), "singular");
  expect_refused(read("space directions: (1,0,0) (0,1e308,0) (0,1e308,1)\nspace origin: (0,1e308,0)\n"), "far corner");
  EXPECT_FALSE(read("space directions: (1,0,0) (0,inf,0) (0,0,1)\n"));
}

TEST(Nrrd, ReadsRawGzipAndText) {
  const TempDir folder;
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: raw\n\n" + kSamples)));
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: raw\n\n" + kSamples + "more")));
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: gzip\n\n" + gzip(kSamples))));
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: gz\n\n" + gzip(kSamples.substr(0, 9)) + gzip(kSamples.substr(9)))));
  std::string text;
  for (const char c : kSamples) text += std::to_string(int(c)) + (c % 2 == 0 ? ", " : "\n");
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: ascii\n\n" + text)));
}

TEST(Nrrd, ReadsLineEndsOfWindowsAndIgnoresDecoration) {
  const TempDir folder;
  expect_samples(read_nrrd(folder.file("v.nrrd",
                                       "NRRD0005\r\n# a comment\r\ntype: unsigned char\r\nDimension: 3\r\nsizes: 3 2 4\r\n"
                                       "key:=value: more\r\ncontent: %s%n\r\nencoding: raw\r\n\r\n" +
                                           kSamples)));
}

TEST(Nrrd, SkipsLinesAndBytesFromEitherEnd) {
  const TempDir folder;
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: raw\nline skip: 2\nbyte skip: 3\n\none\ntwo\n123" + kSamples)));
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: raw\nbyte skip: -1\n\nwhatever" + kSamples)));
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: raw\nbyte skip: -4\n\nwhatever" + kSamples + "123")));
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: gzip\nline skip: 1\nbyte skip: 3\n\none\n" + gzip("123" + kSamples))));
  expect_samples(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: gzip\nbyte skip: -1\n\n" + gzip("header" + kSamples))));
  for (const char* skip : {"line skip: 1", "line skip: 4294967295", "byte skip: 1", "byte skip: 9223372036854775807", "byte skip: -2",
                           "byte skip: -9223372036854775808"}) {
    SCOPED_TRACE(skip);
    EXPECT_FALSE(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: raw\n" + skip + "\n\n" + kSamples)));
    EXPECT_FALSE(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: gzip\n" + skip + "\n\n" + gzip(kSamples))));
    EXPECT_FALSE(read_nrrd(folder.file("v.nrrd", kSizes + "encoding: ascii\n" + skip + "\n\n" + kSamples)));
  }
}

TEST(Nrrd, SwapsBigEndianSamples) {
  const TempDir folder;
  const auto volume = read_nrrd(folder.file("v.nrrd", "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 2 2\nendian: big\nencoding: raw\n\n" +
                                                          std::string("\0\1\0\2\0\3\0\4\0\5\0\6\0\7\377\370", 16)));
  ASSERT_TRUE(volume) << volume.error().message;
  visit_samples(*volume, [](auto samples) {
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(static_cast<int>(samples[i]), int(i) + 1);
    EXPECT_EQ(static_cast<int>(samples[7]), -8);
  });
}

TEST(Nrrd, PlacesTheGrid) {
  const TempDir folder;
  const auto grid = [&](const std::string& fields) {
    const auto volume = read_nrrd(folder.file("v.nrrd", kSizes + fields + "encoding: raw\n\n" + kSamples));
    EXPECT_TRUE(volume) << volume.error().message;
    return volume ? volume->grid : Grid{};
  };
  EXPECT_EQ(grid(""), (Grid{{3, 2, 4}, {}}));
  EXPECT_EQ(grid("spacings: 1 2.5 nan\naxis mins: 7 nan -1\n"), (Grid{{3, 2, 4}, Affine::of({1, 2.5, 1}, {7, 0, -1})}));
  EXPECT_EQ(grid("spacings: 1 -2 3\n"), (Grid{{3, 2, 4}, Affine::of({1, -2, 3})}));
  EXPECT_EQ(grid("axis mins: 1 0 -3\naxis maxs: 2 -5 3\n"), (Grid{{3, 2, 4}, Affine::of({0.5, -5, 2}, {1, 0, -3})}));
  EXPECT_EQ(grid("axis mins: 1 0 -3\naxis maxs: 4 nan 5\ncenterings: cell cell cell\n"), (Grid{{3, 2, 4}, Affine::of({1, 1, 2}, {1.5, 0, -2})}));
  EXPECT_EQ(grid("axis mins: 1 0 -3\naxis maxs: 4 4 -3\nspacings: 2 nan nan\n"), (Grid{{3, 2, 4}, Affine::of({2, 4, 1}, {1, 0, -3})}));
  EXPECT_EQ(grid("space: left-posterior-superior\nspace directions: (2,0,0) (0,3,4) (0,1e-3,-1)\nspace origin: (9,8,7)\n"),
            (Grid{{3, 2, 4}, Affine{{2, 0, 0, 9, 0, 3, 1e-3, 8, 0, 4, -1, 7}}}));
}

TEST(Nrrd, RefusesWhatIsNoVolumeOfNumbers) {
  const TempDir folder;
  const auto read = [&](const std::string& text) { return read_nrrd(folder.file("v.nrrd", text + "\n" + std::string(4096, 'x'))); };
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 2\nsizes: 4 4\nencoding: raw\n"), "2 axes; a volume has 3");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 4\nsizes: 2 4 4 4\nencoding: raw\n"), "4 time points");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 4\nsizes: 2 4 4 4\nkinds: domain domain domain domain\nencoding: raw\n"), "4 axes");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 4 4 4\nkinds: time domain domain domain\nencoding: raw\n"), "4 axes");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 4 4 4\nkinds: vector list domain domain\nencoding: raw\n"), "'list'");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 4 4\nkinds: RGB-color domain domain\nencoding: raw\n"), "RGB-color");
  expect_refused(read("NRRD0004\ntype: int64\ndimension: 3\nsizes: 3 4 4\nendian: little\nencoding: raw\n"), "64-bit");
  expect_refused(read("NRRD0004\ntype: block\nblock size: 3\ndimension: 3\nsizes: 3 4 4\nencoding: raw\n"), "block");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 4 4\nencoding: raw\n"), "1 sample on axis x");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 0 4 4\nencoding: raw\n"), "v.nrrd");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 4\nencoding: raw\n"), "parsed 2 values");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 4 4\nencoding: hex\n"), "hex");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 4 4\nencoding: hex\n"), "hex");
  expect_refused(read("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 4 4\n"), "no 'encoding' line");
  expect_refused(read("NRRD0004\ndimension: 3\nsizes: 2 4 4\nencoding: raw\n"), "v.nrrd");
  expect_refused(read("NRRD0004\ntype: short\ndimension: 3\nsizes: 2 4 4\nencoding: raw\n"), "endian");
  expect_refused(read("NRRD0004\nspacing: 1 1 1\ntype: uint8\ndimension: 3\nsizes: 2 4 4\nencoding: raw\n"), "spacing");
  expect_refused(read("P5\n4 4\n255\n"), "not an NRRD file");
  expect_refused(read_nrrd(folder.file("v.nrrd", "")), "v.nrrd");
}

TEST(Nrrd, ReadsVectors) {
  const TempDir folder;
  const std::string start = "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 2 2 2\n", raw = "encoding: raw\n\n" + kSamples;
  const std::string directions = "space dimension: 3\nspace directions: none (2,0,0) (0,3,0) (0,0,4)\nspace origin: (5,6,7)\n";
  for (const std::string& lines :
       {std::string(), std::string("kinds: 3-vector space space space\n"), directions, std::string("spacings: nan 2 3 4\n")}) {
    const auto volume = read_nrrd(folder.file("v.nrrd", start + lines + raw));
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->components, 3u);
    EXPECT_EQ(volume->grid.dims, (std::array<std::int32_t, 3>{2, 2, 2}));
    EXPECT_EQ(volume->grid.affine.spacing(), (lines.find('2') == std::string::npos ? Vec3{1, 1, 1} : Vec3{2, 3, 4}));
    EXPECT_EQ(bytes_of(*volume), kSamples);
    EXPECT_EQ(bytes_of(component_of(*volume, 1)), "behknqtw");
  }
  expect_refused(read_nrrd(folder.file("v.nrrd", start + "encoding: raw\n\n" + kSamples.substr(1))), "cut short");
  const std::string huge = "NRRD0004\ntype: double\ndimension: 4\nsizes: 3 1048576 1048576 1048576\nendian: little\n";
  expect_refused(read_nrrd(folder.file("v.nrrd", huge + "encoding: raw\n\n" + kSamples)), "too many samples");
}

TEST(Nrrd, ReadsDetachedDataBesideOrBelow) {
  const TempDir folder;
  fs::create_directory(folder / "below");
  folder.file("v.raw", kSamples);
  folder.file("below/v.gz", gzip(kSamples));
  expect_samples(read_nrrd(folder.file("v.nhdr", kSizes + "encoding: raw\ndata file: v.raw\n")));
  expect_samples(read_nrrd(folder.file("v.nhdr", kSizes + "encoding: raw\ndatafile: ./v.raw")));
  expect_samples(read_nrrd(folder.file("v.nhdr", kSizes + "encoding: gzip\ndata file: below/v.gz\n\n")));
}

TEST(Nrrd, DetachedDataStaysInTheHeadersFolder) {
  const TempDir folder;
  fs::create_directory(folder / "in");
  folder.file("secret.raw", kSamples);
  fs::create_symlink(folder / "secret.raw", folder / "in/link.raw");
  fs::create_symlink(folder.path(), folder / "in/up");
  const auto read = [&](const std::string& name) { return read_nrrd(folder.file("in/v.nhdr", kSizes + "encoding: raw\n" + name + "\n")); };
  expect_refused(read("data file: ../secret.raw"), "outside the header's folder");
  expect_refused(read("DATAFILE: ../secret.raw"), "outside the header's folder");
  expect_refused(read("data  file: x/../../secret.raw"), "outside the header's folder");
  expect_refused(read("data file: " + (folder / "secret.raw").string()), "outside the header's folder");
  expect_refused(read("data file: link.raw"), "outside the header's folder");
  expect_refused(read("data file: up/secret.raw"), "outside the header's folder");
  expect_refused(read("data file: none.raw"), "No such file");
  expect_refused(read("data file: "), "names none");
  expect_refused(read("data file: ."), "not a regular file");
  expect_refused(read("data file: slice%03d.raw 1 4 1"), "several files");
  expect_refused(read("data file: %s%s%n 1 4 1"), "several files");
  expect_refused(read("data file: LIST\n\na.raw\nb.raw"), "several files");
  expect_refused(read("data file: a.raw\ndata file: b.raw"), "two 'data file' lines");
}

TEST(Nrrd, AHeaderThatClaimsHugeSizesAllocatesNothing) {
  const TempDir folder;
  for (const char* encoding : {"raw", "gzip", "ascii"})
    for (const char* sizes : {"1048576 1048576 1048576", "4 1048576 1048576", "18446744073709551615 2 2", "99999999999999999999999 2 2", "-1 -1 2"}) {
      SCOPED_TRACE(std::string(encoding) + " " + sizes);
      const std::string head =
          "NRRD0004\ntype: double\ndimension: 3\nendian: little\nsizes: " + std::string(sizes) + "\nencoding: " + encoding + "\n\n";
      expect_refused(read_nrrd(folder.file("v.nrrd", head + gzip(kSamples))), "v.nrrd");
    }
}

TEST(Nrrd, RefusesEveryTruncation) {
  const TempDir folder;
  for (const auto& whole : {kSizes + "encoding: raw\n\n" + kSamples, kSizes + "encoding: gzip\n\n" + gzip(kSamples)})
    for (std::size_t size = 0; size < whole.size(); ++size) {
      SCOPED_TRACE(size);
      expect_refused(read_nrrd(folder.file("v.nrrd", whole.substr(0, size))), "v.nrrd");
    }
}

TEST(Nrrd, AGzipBitFlippedIsNoticed) {
  const TempDir folder;
  const auto packed = gzip(kSamples);
  for (std::size_t bit = 10 * 8; bit < packed.size() * 8; ++bit) {
    auto flipped = packed;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
    const auto volume = read_nrrd(folder.file("v.nrrd", kSizes + "encoding: gzip\n\n" + flipped));
    if (volume) {  // a bit between the last code and the next whole byte: no data
      EXPECT_EQ(bytes_of(*volume), kSamples) << "bit " << bit;
      EXPECT_EQ(bit / 8, packed.size() - 9);
    }
  }
}

// Nothing but a volume or one line may come of any header: run under the address sanitizer this is the test of teem's
// parser as well.
TEST(Nrrd, SurvivesDamagedHeaders) {
  const TempDir folder;
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::string whole =
      "NRRD0005\n# comment\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 4\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
      "centerings: cell cell cell\nkinds: domain domain domain\nlabels: \"x\" \"y\" \"z\"\naxis mins: 0 0 0\nspacings: 1 1 1\nendian: big\n"
      "encoding: raw\nspace origin: (0,0,0)\nline skip: 0\nbyte skip: 0\nkey:=value\nold min: 3\n\n" +
      kSamples + kSamples;
  for (int round = 0; round < 3000; ++round) {
    auto damaged = whole;
    for (auto blows = 1 + random() % 4; blows > 0 && !damaged.empty(); --blows) {
      const auto at = random() % damaged.size();
      switch (random() % 5) {
        case 0:
          damaged[at] = static_cast<char>(random());
          break;
        case 1:
          damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
          break;
        case 2:
          damaged.erase(at, 1 + random() % 20);
          break;
        case 3:
          damaged.insert(at, damaged.substr(random() % damaged.size(), random() % 30));
          break;
        default:
          damaged.insert(at, std::string(1 + random() % 3000, "0(9,-\t"[random() % 6]));
          break;
      }
    }
    const auto volume = read_nrrd(folder.file("v.nrrd", damaged));
    if (volume) {
      EXPECT_EQ(volume->bytes.size(), volume->grid.sample_count() * size_of(volume->type));
    } else {
      EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
    }
  }
}

TEST(Nrrd, AHeaderWithoutEndIsRefused) {
  const TempDir folder;
  expect_refused(read_nrrd(folder.file("v.nrrd", kSizes + std::string(2000, 'x'))), "longer than 512");
  std::string comments;
  while (comments.size() < 3 << 20) comments += "# nothing\n";
  expect_refused(read_nrrd(folder.file("v.nrrd", kSizes + comments)), "longer than 1 MiB");
  expect_refused(read_nrrd(folder.file("v.nrrd", kSizes + std::string("encoding: raw\n\0\n\n", 17) + kSamples)), "zero bytes");
}

}  // namespace
}  // namespace intervale
