// Zarr folders, which a program of its own reads.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "common/patch/visit_samples.h"
#include "server/volume/read_volume.h"
#include "tests/support/temp_dir.h"
#include "tests/support/volume_files.h"

namespace intervale {
namespace {

using Json = nlohmann::json;

class ZarrFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(std::filesystem::read_symlink("/proc/self/exe").parent_path() / "read-zarr")) GTEST_SKIP() << "no read-zarr";
  }
  static void write(const std::filesystem::path& path, const std::string& text) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
  }
  static Json description(const std::vector<int>& shape, const std::vector<int>& chunks) {
    return {{"zarr_format", 2}, {"shape", shape},       {"chunks", chunks},  {"dtype", "<u2"},
            {"fill_value", 7},  {"compressor", Json()}, {"filters", Json()}, {"order", "C"}};
  }
  // 5 x 3 x 2 samples (x, y, z): 100 z + 10 y + x. Chunks of 2 x 2 x 1, that of (4, 2, 1) is missing.
  void write_array(const std::string& folder, const Json& about, const std::string& suffix = {}) const {
    write(folder_ / folder / ".zarray", about.dump());
    for (int z = 0; z < 2; ++z) {
      for (int y = 0; y < 3; y += 2) {
        for (int x = 0; x < 5; x += 2) {
          if (x == 4 && y == 2 && z == 1) continue;
          std::string bytes;
          for (int j = 0; j < 2; ++j) {
            for (int i = 0; i < 2; ++i) bytes += {char(100 * z + 10 * (y + j) + x + i), '\0'};
          }
          if (about["compressor"].is_object())
            bytes = deflated(bytes, about["compressor"]["id"] == "gzip" ? testing::Wrapping::gzip : testing::Wrapping::zlib);
          write(folder_ / folder / (std::to_string(z) + "." + std::to_string(y / 2) + "." + std::to_string(x / 2) + suffix), bytes);
        }
      }
    }
  }
  static void expect_samples(const Result<Volume>& volume) {
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->grid.dims, (std::array<std::int32_t, 3>{5, 3, 2}));
    visit_samples(*volume, [](auto samples) {
      for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(int(samples[i]), i == 29 ? 7 : int(100 * (i / 15) + 10 * (i / 5 % 3) + i % 5)) << i;
    });
  }
  void expect_failure(const std::string& part, bool usage = false) const {
    const auto volume = read_volume(folder_ / "v", {});
    ASSERT_FALSE(volume) << part;
    EXPECT_NE(volume.error().message.find(part), std::string::npos) << volume.error().message;
    EXPECT_EQ(volume.error().usage, usage);
  }
  const TempDir folder_;
};

TEST_F(ZarrFolder, ChunksAreJoined) {
  write_array("v", description({2, 3, 5}, {1, 2, 2}));
  expect_samples(read_volume(folder_ / "v", {}));
  for (const char* codec : {"zlib", "gzip"}) {
    Json about = description({2, 3, 5}, {1, 2, 2});
    about["compressor"] = {{"id", codec}, {"level", 1}};
    write_array("v", about);
    expect_samples(read_volume(folder_ / "v", {}));
  }
}

TEST_F(ZarrFolder, OmeNamesAxesArraysAndDistances) {
  Json about = description({2, 3, 5}, {1, 2, 2});
  write_array("v/0", about);
  about["shape"] = {1, 3, 5};
  write_array("v/1", about);
  write(folder_ / "v/.zgroup", "{\"zarr_format\": 2}");
  const auto scaled = [](const char* path, double z) {
    return Json{{"path", path},
                {"coordinateTransformations",
                 Json::array({{{"type", "scale"}, {"scale", {z, 2, 0.5}}}, {{"type", "translation"}, {"translation", {30, 20, 10}}}})}};
  };
  const auto axis = [](const char* name) { return Json{{"name", name}, {"type", "space"}, {"unit", "micrometer"}}; };
  const Json multiscale{{"axes", {axis("z"), axis("y"), axis("x")}}, {"datasets", {scaled("0", 3), scaled("1", 6)}}};
  write(folder_ / "v/.zattrs", Json{{"multiscales", Json::array({multiscale})}}.dump());
  expect_failure("2 arrays: choose one with --part: /0 (5 x 3 x 2 of u16), /1 (5 x 3 x 1 of u16)", true);
  const auto named = named_volume((folder_ / "v").string() + ":/0");
  const auto volume = read_volume(named.path, {}, {}, named.part);
  expect_samples(volume);
  EXPECT_EQ(volume->grid.affine, Affine::of({0.5, 2, 3}, {10, 20, 30}));
  EXPECT_EQ(volume->labels.unit, "\u00b5m");
}

TEST_F(ZarrFolder, WhatIsDamagedIsNamed) {
  const Json about = description({2, 3, 5}, {1, 2, 2});
  write_array("v", about);
  write(folder_ / "v/1.0.1", "short");
  expect_failure("1.0.1' is damaged: it is no chunk of 8 bytes");
  write(folder_ / "v/.zarray", about.dump().substr(0, 50));
  expect_failure("is no JSON");
  write(folder_ / "v/.zarray", Json{{"zarr_format", 2}}.dump());
  expect_failure("not those of Zarr");
  write(folder_ / "v/.zarray", description({100'000, 100'000, 100'000}, {100, 100, 100}).dump());
  expect_failure("of its samples");
  write(folder_ / "v/.zarray", description({2, 3, 5}, {1, 0, 2}).dump());
  expect_failure("its chunks are empty");
  write(folder_ / "v/.zarray", description({3, 5}, {1, 2}).dump());
  expect_failure("has no array");
  write(folder_ / "v/.zattrs", "{\"multiscales\": [{\"datasets\": [{\"path\": \"../w\"}]}]}");
  expect_failure("names an array outside itself");
  write(folder_ / "v/.zattrs", "{\"multiscales\": 5}");
  const auto volume = read_volume(folder_ / "v", {});
  EXPECT_FALSE(volume);
}

class DamagedZarr : public ZarrFolder, public ::testing::WithParamInterface<int> {};

// Its metadata, more often than a chunk.
TEST_P(DamagedZarr, DoesNoHarm) {
  Json about = description({2, 3, 5}, {1, 2, 2});
  about["compressor"] = {{"id", "zlib"}, {"level", 1}};
  write_array("v", about);
  const std::string attributes = "{\"multiscales\": [{\"axes\": [\"z\", \"y\", \"x\"], \"datasets\": [{\"path\": \"\"}]}]}";
  const struct {
    const char* name;
    std::string bytes;
  } files[] = {{".zarray", about.dump()}, {".zattrs", attributes}, {"0.0.0", contents_of(folder_ / "v/0.0.0")}};
  for (const auto& file : files) write(folder_ / "v" / file.name, file.bytes);
  std::mt19937 random(unsigned(GetParam()) + 7);
  for (int trial = 0; trial < 50; ++trial) {
    const auto& [name, whole] = files[trial % 5 < 3 ? 0 : trial % 5 - 2];
    std::string bytes = whole;
    for (int k = 0; k < 1 + trial / 20; ++k) bytes[random() % bytes.size()] = trial % 2 == 0 ? char(random()) : char('0' + random() % 75);
    if (trial % 10 == 0) bytes.resize(random() % bytes.size());
    write(folder_ / "v" / name, bytes);
    const auto volume = read_volume(folder_ / "v", {}, 0);
    if (volume) {
      EXPECT_EQ(volume->bytes.size(), volume->grid.sample_count() * size_of(volume->type));
    } else {
      EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
    }
    write(folder_ / "v" / name, whole);
  }
}

INSTANTIATE_TEST_SUITE_P(Fifty, DamagedZarr, ::testing::Range(0, 5));

}  // namespace
}  // namespace intervale
