// `mpirun -n N intervale build`: the same file, byte for byte, and what happens if a rank dies. Skipped without MPI.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

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
    const std::string volume = folder / (field + size + ".nrrd");
    EXPECT_EQ(run({program("intervale"), "sample", field, "--size", size, "--type", "u16", "-o", volume}).status, 0);
    return volume;
  }
  void expect_same_file(const Arguments& input, const Arguments& more = {}) const {
    const auto plain = run(build(input, expected, more));
    ASSERT_EQ(plain.status, 0) << plain.err;
    for (const int ranks : {1, 2, 4, 8}) {
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

// Raw samples that fill all of their type, in a wave with some noise.
template <class T>
Arguments raw_volume(const TempDir& folder, const std::array<int, 3>& dims, const char* type, double least, double greatest) {
  std::mt19937 random(7);
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
  return {folder.file("raw", bytes).string(), "--dims", std::to_string(dims[0]), std::to_string(dims[1]), std::to_string(dims[2]), "--type", type};
}

TEST_F(ClusterBuild, OfFewBytesIsTheSameFile) { expect_same_file(raw_volume<std::uint8_t>(folder, {37, 65, 20}, "u8", 0, 255)); }
TEST_F(ClusterBuild, OfBytesIsTheSameFile) { expect_same_file(raw_volume<std::uint8_t>(folder, {130, 70, 129}, "u8", 0, 255)); }
TEST_F(ClusterBuild, OfWholeNumbersIsTheSameFile) { expect_same_file(raw_volume<std::int16_t>(folder, {100, 70, 129}, "i16", -32768, 32767)); }
TEST_F(ClusterBuild, OfFloatsIsTheSameFile) { expect_same_file(raw_volume<float>(folder, {64, 130, 66}, "f32", -1, 2)); }
TEST_F(ClusterBuild, OfFloatsWithAStepIsTheSameFile) { expect_same_file(raw_volume<float>(folder, {64, 130, 66}, "f32", -1, 2), {"--step", "0.01"}); }
TEST_F(ClusterBuild, OfExactFloatsIsTheSameFile) { expect_same_file(raw_volume<float>(folder, {66, 65, 64}, "f32", -1, 2), {"--step", "0"}); }
TEST_F(ClusterBuild, OfAThinBoxIsTheSameFile) { expect_same_file(raw_volume<std::uint16_t>(folder, {150, 3, 150}, "u16", 0, 65535)); }
TEST_F(ClusterBuild, OfACubeIsTheSameFile) { expect_same_file({sample("marschner-lobb", "129")}); }

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
  ASSERT_EQ(run(build({volume}, expected)).status, 0);
  const Arguments resumed = on_ranks(2, build({volume}, out, {"--resume"}));
  std::mt19937 random(std::random_device{}());
  int kills = 0;
  for (int tries = 0; tries < 20 && kills < 3; ++tries) {
    Process job(resumed);
    int rank = 0;
    while (rank == 0) {  // its ranks start after some tenths of a second
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      rank = process_of_a_rank(job.id());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 1500));
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
