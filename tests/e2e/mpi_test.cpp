// `mpirun -n N intervale build`: the same file, byte for byte, and what happens if a rank dies. Skipped without MPI.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/library_files.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"
#include "tests/support/volume_files.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsResidentKnownOfRanks = false;  // sanitizers have memory of their own
const std::string kSizeOnRanks = "65";
#else
constexpr bool kIsResidentKnownOfRanks = true;
const std::string kSizeOnRanks = "193";
#endif

struct ClusterBuild : ::testing::Test {
  TempDir folder;
  std::string expected = folder / "expected.ivm", out = folder / "out.ivm";

  void SetUp() override {
    if (!std::filesystem::exists(program("intervale-mpi"))) GTEST_SKIP() << "built without MPI";
    if (run({"/bin/sh", "-c", "command -v mpirun"}).status != 0) GTEST_SKIP() << "mpirun is not installed";
  }

  // As many ranks on this machine, whoever runs the tests.
  static Arguments on_ranks(int ranks, const Arguments& arguments) {
    return Arguments{"/usr/bin/env", "OMPI_ALLOW_RUN_AS_ROOT=1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1", "mpirun", "--oversubscribe",
                     "-n",           std::to_string(ranks)} +
           arguments;
  }
  static Arguments build(const Arguments& input, const std::string& to, const Arguments& more = {}) {
    return Arguments{program("intervale"), "build"} + input + Arguments{"-o", to, "--threads", "1"} + more;
  }
  [[nodiscard]] std::string sample(const std::string& field, const std::string& size) const {
    std::string volume = folder / (field + size + ".nrrd");
    EXPECT_EQ(run({program("intervale"), "sample", field, "--size", size, "--type", "u16", "-o", volume}).status, 0);
    return volume;
  }
  void expect_same_file(const Arguments& input, const Arguments& more = {}, const std::vector<int>& sizes = {1, 2, 4, 8}) const {
    const auto plain = run(build(input, expected, more));
    ASSERT_EQ(plain.status, 0) << plain.err;
    for (const int ranks : sizes) {
      std::filesystem::remove(out);
      const auto made = run(on_ranks(ranks, build(input, out, more)));
      ASSERT_EQ(made.status, 0) << made.err;
      EXPECT_TRUE(contents_of(expected) == contents_of(out)) << ranks << " ranks";
      EXPECT_THAT(made.out, HasSubstr("wrote " + out));
    }
  }
  void expect_only(const std::vector<std::string>& names) const {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
      EXPECT_TRUE(std::find(names.begin(), names.end(), entry.path().filename()) != names.end()) << entry.path();
  }
};

// Samples from `least` to `greatest`, in a wave with some noise.
template <class T>
std::string wave(const std::array<int, 3>& dims, double least, double greatest, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::string bytes;
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) {
        const double wave = std::sin(x / 7.0) * std::cos(y / 5.0) + std::sin(z / 11.0 + x / 20.0) + double(random() % 100) / 500;
        const T sample = x + y + z == 0 ? T(greatest) : x + y + z == 1 ? T(least) : T(least + (greatest - least) * (wave + 2) / 4.2);
        bytes.append(reinterpret_cast<const char*>(&sample), sizeof sample);
      }
    }
  }
  return bytes;
}

// Raw ones, that fill all of their type.
template <class T>
Arguments raw_volume(const TempDir& folder, const std::array<int, 3>& dims, const char* type, double least, double greatest) {
  return {folder.file("raw", wave<T>(dims, least, greatest)).string(),
          "--dims",
          std::to_string(dims[0]),
          std::to_string(dims[1]),
          std::to_string(dims[2]),
          "--type",
          type};
}

TEST_F(ClusterBuild, OfFewBytesIsTheSameFile) { expect_same_file(raw_volume<std::uint8_t>(folder, {37, 65, 20}, "u8", 0, 255)); }
TEST_F(ClusterBuild, OfBytesIsTheSameFile) { expect_same_file(raw_volume<std::uint8_t>(folder, {130, 70, 129}, "u8", 0, 255)); }
TEST_F(ClusterBuild, OfWholeNumbersIsTheSameFile) { expect_same_file(raw_volume<std::int16_t>(folder, {100, 70, 129}, "i16", -32768, 32767)); }
TEST_F(ClusterBuild, OfFloatsIsTheSameFile) { expect_same_file(raw_volume<float>(folder, {64, 130, 66}, "f32", -1, 2)); }
TEST_F(ClusterBuild, OfFloatsWithAStepIsTheSameFile) { expect_same_file(raw_volume<float>(folder, {64, 130, 66}, "f32", -1, 2), {"--step", "0.01"}); }
TEST_F(ClusterBuild, OfExactFloatsIsTheSameFile) { expect_same_file(raw_volume<float>(folder, {66, 65, 64}, "f32", -1, 2), {"--step", "0"}); }
TEST_F(ClusterBuild, OfAThinBoxIsTheSameFile) { expect_same_file(raw_volume<std::uint16_t>(folder, {150, 3, 150}, "u16", 0, 65535)); }
TEST_F(ClusterBuild, OfACubeIsTheSameFile) { expect_same_file({sample("marschner-lobb", "129")}); }

TEST_F(ClusterBuild, OfATableIsTheSameFile) {
  expect_same_file(raw_volume<double>(folder, {65, 20, 66}, "f64", -1, 2), {"--step", "0"}, {3});
  expect_same_file(raw_volume<std::int32_t>(folder, {65, 20, 66}, "i32", -0x1p31, 0x1p31 - 1), {}, {3});
}

constexpr std::array<int, 3> kWaveDims{70, 66, 68};

// One number a sample, or a vector of three.
std::string nrrd(const std::string& type, const std::string& samples, bool is_vector = false, bool is_compressed = false,
                 const std::array<int, 3>& dims = kWaveDims) {
  std::string sizes;
  for (const int n : dims) sizes += " " + std::to_string(n);
  return "NRRD0004\ntype: " + type + "\nendian: little\nencoding: " + (is_compressed ? "gzip" : "raw") + "\n" +
         (is_vector ? "dimension: 4\nkinds: vector domain domain domain\nsizes: 3" : "dimension: 3\nsizes:") + sizes + "\n\n" +
         (is_compressed ? testing::deflated(samples, testing::Wrapping::gzip) : samples);
}

// Of numbers that mean slope * number + intercept.
std::string nifti(const std::string& samples, float slope, float intercept) {
  std::string header(352, '\0');
  const auto put = [&header](std::size_t at, auto number) { std::memcpy(&header[at], &number, sizeof number); };
  put(0, std::int32_t(348));
  put(40, std::int16_t(3));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put(42 + 2 * axis, std::int16_t(kWaveDims[axis]));
    put(80 + 4 * axis, 1.0F);
  }
  put(70, std::int16_t(4));  // i16
  put(72, std::int16_t(16));
  put(108, 352.0F);
  put(112, slope);
  put(116, intercept);
  header.replace(344, 3, "n+1");
  return header + samples;
}

TEST_F(ClusterBuild, OfCompressedSamplesIsTheSameFile) {
  constexpr std::array<int, 3> kDims{210, 190, 34};  // slices of several chunks of the decoder
  const std::string file = folder.file("wave.nrrd", nrrd("float", wave<float>(kDims, -900, 3000), false, true, kDims)).string();
  expect_same_file({file}, {}, {2, 5});
  expect_same_file({file}, {"--crop", "1", "209", "3", "160", "2", "33"}, {3});
}

TEST_F(ClusterBuild, OfRescaledSamplesIsTheSameFile) {
  const std::string samples = wave<std::int16_t>(kWaveDims, -900, 3000);
  for (const auto& [slope, intercept] : std::vector<std::pair<float, float>>{{1.0F, -1024.0F}, {1000.0F, 0.0F}, {0.25F, 7.0F}})
    expect_same_file({folder.file("wave.nii", nifti(samples, slope, intercept)).string()}, {}, {3});
}

TEST_F(ClusterBuild, OfFilesThatALibraryReadsIsTheSameFile) {
  std::vector<std::vector<std::uint16_t>> pages(20, std::vector<std::uint16_t>(70 * 66));
  const std::string samples = wave<std::uint16_t>({70, 66, 20}, 0, 65535);
  for (std::size_t z = 0; z < pages.size(); ++z) std::memcpy(pages[z].data(), &samples[z * 70 * 66 * 2], 70 * 66 * 2);
  expect_same_file({folder.file("wave.tif", testing::tiff_file(70, 66, pages)).string()}, {}, {2});
}

TEST_F(ClusterBuild, WithChannelsIsTheSameFile) {
  const std::array<int, 3> three{3 * kWaveDims[0], kWaveDims[1], kWaveDims[2]};
  const std::string field = folder.file("field.nrrd", nrrd("float", wave<float>(kWaveDims, -1, 2))).string();
  const std::string heat = folder.file("heat.nrrd", nrrd("short", wave<std::int16_t>(kWaveDims, 0, 900, 8), false, true)).string();
  const std::string wind = folder.file("wind.nrrd", nrrd("float", wave<float>(three, -5, 9, 9), true)).string();
  const Arguments both{"--channel", "heat=" + heat, "--channel", "wind=" + wind, "--channel-step", "wind=0.125"};
  expect_same_file({field}, both);
  expect_same_file({field}, both + Arguments{"--crop", "4", "69", "0", "60", "2", "66"}, {3});
  expect_same_file({wind, "--part", "1"}, {"--channel", "heat=" + heat}, {3});

  const auto made = run(on_ranks(2, build({field}, out, both + Arguments{"--json"})));
  EXPECT_EQ(nlohmann::json::parse(made.out)["channels"][1]["name"], "wind");
  const auto other = run(on_ranks(2, build({field}, out, {"--channel", "heat=" + sample("gyroid", "33")})));
  EXPECT_EQ(other.status, 1);
  EXPECT_THAT(other.err, HasSubstr("intervale: channel 'heat' has 33 x 33 x 33 samples, the field has 70 x 66 x 68\n"));
}

TEST_F(ClusterBuild, SamplesThatAreNoNumbersAreRefusedOrReplaced) {
  std::string samples = wave<float>(kWaveDims, -1, 2);
  const float nan = std::nanf("");
  std::memcpy(&samples[4 * std::size_t((60 * kWaveDims[1] + 5) * kWaveDims[0] + 6)], &nan, sizeof nan);
  const std::string volume = folder.file("hole.nrrd", nrrd("float", samples)).string();
  expect_same_file({volume}, {"--nan", "0"}, {3});
  std::filesystem::remove(out);
  const auto made = run(on_ranks(3, build({volume}, out)));
  EXPECT_EQ(made.status, 1);
  EXPECT_THAT(made.err, HasSubstr("intervale: sample (6, 5, 60) of 'hole' is NaN; give such samples a value with --nan VALUE\n"));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(ClusterBuild, ARankNeedsLessMemoryTheMoreThereAre) {
  if (!kIsResidentKnownOfRanks) GTEST_SKIP() << "a sanitizer has memory of its own";
  const std::string volume = sample("marschner-lobb", "257");
  std::uint64_t before = ~std::uint64_t(0);
  for (const int ranks : {2, 8}) {
    const auto made = run(on_ranks(ranks, build({volume}, out, {"--json"})));
    ASSERT_EQ(made.status, 0) << made.err;
    const auto resident = nlohmann::json::parse(made.out)["resident_bytes"].get<std::vector<std::uint64_t>>();
    ASSERT_EQ(resident.size(), std::size_t(ranks));
    const std::uint64_t most = *std::max_element(resident.begin(), resident.end());
    EXPECT_LT(most, before);
    before = most;
  }
}

TEST_F(ClusterBuild, WithinABudgetIsTheSameFile) {
  const std::string volume = sample("gyroid", kSizeOnRanks);
  ASSERT_EQ(run(build({volume}, expected)).status, 0);
  const auto made = run(on_ranks(2, build({volume}, out, {"--memory", "96MiB", "--json"})));
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(contents_of(expected) == contents_of(out));
  if (!kIsResidentKnownOfRanks) return;
  for (const std::uint64_t resident : nlohmann::json::parse(made.out)["resident_bytes"].get<std::vector<std::uint64_t>>())
    EXPECT_LE(resident, std::uint64_t(96) << 20);
}

// The rank of a job, as a process.
int process_of_a_rank(int mpirun) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    std::string id, name, state;
    int parent = 0;
    if (file >> id >> name >> state >> parent && parent == mpirun && name == "(intervale-mpi)") return std::stoi(id);
  }
  return 0;
}

TEST_F(ClusterBuild, GoesOnAfterARankWasKilled) {
  const std::string volume = sample("gyroid", kSizeOnRanks);
  const Arguments channel{"--channel", "same=" + volume};
  ASSERT_EQ(run(build({volume}, expected, channel)).status, 0);
  const Arguments resumed = on_ranks(2, build({volume}, out, channel + Arguments{"--resume"}));
  std::mt19937 random(std::random_device{}());
  int kills = 0;
  for (int tries = 0; tries < 20 && kills < 3; ++tries) {
    Process job(resumed);
    int rank = 0;
    while (rank == 0) {  // its ranks start after some tenths of a second
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      rank = process_of_a_rank(job.id());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 2500));
    const bool is_killed = process_of_a_rank(job.id()) == rank && ::kill(rank, SIGKILL) == 0;
    const auto ended = job.wait();
    if (!is_killed || ended.status == 0) continue;
    ++kills;
    EXPECT_THAT(ended.err, HasSubstr("signal 9"));
    if (std::filesystem::exists(out)) {  // it was killed as it ended
      EXPECT_TRUE(contents_of(expected) == contents_of(out));
      std::filesystem::remove(out);
    }
    expect_only({"expected.ivm", std::filesystem::path(volume).filename(), "out.ivm.0-of-2.resume", "out.ivm.1-of-2.resume"});
  }
  EXPECT_GT(kills, 0);
  const auto made = run(resumed);
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(contents_of(expected) == contents_of(out));
  expect_only({"expected.ivm", "out.ivm", std::filesystem::path(volume).filename()});
}

TEST_F(ClusterBuild, TellsAFailureOnce) {
  const auto missing = run(on_ranks(4, build({folder / "missing.nrrd"}, out)));
  EXPECT_EQ(missing.status, 1);
  const std::string line = "intervale: cannot read '" + (folder / "missing.nrrd").string() + "'";
  EXPECT_THAT(missing.err, HasSubstr(line));
  EXPECT_EQ(missing.err.find(line), missing.err.rfind(line)) << missing.err;
  if (kIsResidentKnownOfRanks) {  // sanitizers refuse so many addresses
    const std::string header = "NRRD0004\ntype: double\ndimension: 3\nsizes: 2048 2048 2048\nencoding: bzip2\nendian: little\n\n";
    const auto promised = run(on_ranks(2, build({folder.file("huge.nrrd", header + testing::bzip2(std::string(9999, 'x'))).string()}, out)));
    EXPECT_EQ(promised.status, 1);
    EXPECT_THAT(promised.err, HasSubstr("the header promises 68719476736 bytes of samples, but 9999 are there; is the file cut short?\n"));
  }
  const auto range = run(on_ranks(2, build({sample("gyroid", "33")}, out, {"--range", "1", "2"})));
  EXPECT_EQ(range.status, 2);
  EXPECT_THAT(range.err, HasSubstr("intervale: a data set of one range under mpirun is not supported yet"));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(ClusterBuild, WithoutMpiIsRefusedInOneLine) {
  const std::string alone = folder / "intervale";
  std::filesystem::copy_file(program("intervale"), alone);
  const auto made = run(on_ranks(2, {alone, "build", sample("gyroid", "33"), "-o", out}));
  EXPECT_EQ(made.status, 1);
  EXPECT_THAT(made.err, HasSubstr("intervale: this program was built without MPI, and builds with one rank only\n"));
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace intervale
