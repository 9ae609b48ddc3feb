// A server whose data sets lie in a scratch file (serve --data-memory).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Sanitizers have memory of their own, and are slow.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsLarge = false;
const std::string kSamples = "129";
#else
constexpr bool kIsLarge = true;
const std::string kSamples = "217";
#endif
constexpr std::uint64_t kDataMemory = 4'000'000;  // the least; a tenth of the data set

// A line of /proc/PID/status, in bytes.
std::uint64_t status_of(int process, const std::string& key) {
  std::ifstream file("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key + ":")) return 1024 * std::stoull(line.substr(key.size() + 1));
  }
  return 0;
}

// A data set of every range: "…/large.ivm"; made once a run.
const std::filesystem::path& large_data_set() {
  static const TempDir folder;
  static const std::filesystem::path path = [] {
    const std::string volume = folder / "volume.nrrd", made = folder / "large.ivm";
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", kSamples, "--type", "u16", "-o", volume}).status, 0);
    EXPECT_EQ(run({program("intervale"), "build", volume, "-o", made}).status, 0);
    std::filesystem::remove(volume);
    return std::filesystem::path(made);
  }();
  return path;
}

std::vector<std::string> in_scratch(const TempDir& folder) {
  return {"--data-memory", std::to_string(kDataMemory), "--scratch", folder.path(), "--threads", "2"};
}

std::string digest_from(const ServerProgram& server) {
  const auto fetched =
      run({program("intervale-client"), "fetch", server.url("large"), "--range", "30000", "34000", "--error-percent", "2", "--digest", "--json"});
  EXPECT_EQ(fetched.status, 0) << fetched.err;
  return nlohmann::json::parse(fetched.out, nullptr, false).value("digest", fetched.out);
}

void expect_exact_meshes(const ServerProgram& server) {
  const auto loaded = run({program("intervale-load"), server.url("large"), "--range", "30000", "34000", "--clients", "4", "--duration", "2",
                           "--pixel-error", "6", "--verify", "--json"});
  ASSERT_EQ(loaded.status, 0) << loaded.err;
  const auto figures = nlohmann::json::parse(loaded.out);
  EXPECT_EQ(figures.at("verified"), 4) << loaded.out;
  EXPECT_EQ(figures.at("failed"), 0) << loaded.out;
}

TEST(DataMemory, ServesWhatIsLargerWithinTheBudget) {
  const TempDir folder("/var/tmp");
  ServerProgram plain(large_data_set().string(), {"--threads", "2"}), small(large_data_set().string(), in_scratch(folder));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the file has no name";
  const std::string digest = digest_from(plain);
  EXPECT_EQ(digest_from(small), digest);
  expect_exact_meshes(small);
  EXPECT_EQ(digest_from(small), digest);
  EXPECT_EQ(metric(small.port(), "intervale_data_memory_limit_bytes"), double(kDataMemory));
  EXPECT_LE(metric(small.port(), "intervale_memory_bytes{holder=\"datasets\"}"), double(kDataMemory));
  EXPECT_EQ(metric(plain.port(), "intervale_data_memory_limit_bytes"), -1) << "nothing of it without the option";
  if (!kIsLarge) return;
  EXPECT_GE(metric(small.port(), "intervale_data_scratch_bytes"), 9.0 * double(kDataMemory));
  EXPECT_GT(metric(small.port(), "intervale_data_evicted_bytes_total"), double(kDataMemory));
  // At any time since the start: while it was loaded, too.
  ServerProgram without(buckyball().string(), {"--threads", "2"});
  constexpr std::uint64_t kMargin = 64 << 20;
  EXPECT_LE(status_of(small.process().id(), "VmHWM"), kDataMemory + kMargin + status_of(without.process().id(), "VmHWM"));
}

TEST(DataMemory, OptionsThatCannotBeAreOneLine) {
  const auto serve = [](const std::vector<std::string>& more) {
    return run(Arguments{program("intervale"), "serve", buckyball().string(), "--listen", "127.0.0.1:0"} + more);
  };
  const auto alone = serve({"--scratch", "/var/tmp"});
  EXPECT_EQ(alone.status, 2);
  EXPECT_EQ(alone.err, "intervale: --scratch belongs to a limit of the data sets' memory: give --data-memory too\n");
  const auto more = serve({"--data-memory", "1GB", "--max-memory", "1GB"});
  EXPECT_EQ(more.status, 2);
  EXPECT_EQ(more.err, "intervale: --max-memory must be more than --data-memory, which it includes\n");
  const auto little = serve({"--data-memory", "1MB"});
  EXPECT_EQ(little.status, 2);
  EXPECT_EQ(little.err, "intervale: --data-memory: a budget of 1 MB is too small: at least 4 MB\n");
  const auto nowhere = serve({"--data-memory", "1GB", "--scratch", "/none"});
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_EQ(nowhere.err, "intervale: --data-memory: cannot make a scratch file in '/none': No such file or directory\n");
  const auto in_memory = serve({"--data-memory", "1GB", "--scratch", "/dev/shm"});
  EXPECT_EQ(in_memory.status, 1);
  EXPECT_EQ(in_memory.err, "intervale: --data-memory: the scratch folder '/dev/shm' lies in memory (tmpfs): name one on a disk\n");
}

// A small disk that does not look like memory.
TEST(DataMemory, AFullScratchDiskRefusesWhatDoesNotFit) {
  const TempDir folder;
  const std::string disk = folder / "disk", files = folder / "files";
  std::filesystem::create_directories(disk);
  std::filesystem::create_directories(files);
  std::filesystem::copy(large_data_set(), files + "/large.ivm");
  std::filesystem::copy(buckyball(), files + "/small.ivm");
  const std::string script =
      "mount -t tmpfs -o size=5m none \"" + disk + "\" && cd \"" + disk +
      "\" && mkdir up work low disk && mount -t overlay -o lowerdir=low,upperdir=up,workdir=work,userxattr none disk || exit 77; ";
  const std::vector<std::string> with_disk{"unshare", "--map-root-user", "--mount", "sh", "-c", script + "exec \"$@\"", "sh"};
  if (run(Arguments{"/usr/bin/env"} + with_disk + Arguments{"true"}).status != 0) GTEST_SKIP() << "no small disk can be had here";
  const std::vector<std::string> options{"--data-memory", "4MB", "--scratch", disk + "/disk"};
  const auto named = run(Arguments{"/usr/bin/env"} + with_disk +
                         Arguments{program("intervale"), "serve", files + "/large.ivm", "--listen", "127.0.0.1:0"} + options);
  EXPECT_EQ(named.status, 1);
  EXPECT_THAT(named.err,
              AllOf(HasSubstr("intervale: " + files + "/large.ivm: cannot be read: the scratch folder '"), HasSubstr("No space left on device\n")));
  ServerProgram server(files, options, with_disk);
  // Its coarse scales, which lie in memory, are served until the rest does not fit.
  EXPECT_TRUE(eventually([&server] { return metric(server.port(), "intervale_datasets") == 1; })) << "the others are served";
  EXPECT_EQ(run({program("intervale-client"), "fetch", server.url("small"), "--digest"}).status, 0);
  server.process().signal(SIGTERM);
  const auto log = server.process().wait();
  EXPECT_EQ(log.status, 0);
  EXPECT_THAT(log.err,
              AllOf(HasSubstr("skipped: " + files + "/large.ivm: cannot be read: the scratch folder '"), HasSubstr("No space left on device\n")));
  // On demand, the coarse scales stay.
  ServerProgram on_demand(files, options + Arguments{"--on-demand"}, with_disk);
  const auto fetch = [&on_demand](const std::string& error) {
    return run(
        {program("intervale-client"), "fetch", on_demand.url("large"), "--range", "30000", "34000", "--error-percent", error, "--reconnect", "1"});
  };
  for (int i = 0; i < 2; ++i) {
    const auto refused = fetch("1");
    EXPECT_EQ(refused.status, 1);
    EXPECT_THAT(refused.err, HasSubstr("the rest of the data set could not be read"));
    EXPECT_EQ(fetch("100").status, 0);
  }
  EXPECT_EQ(metric(on_demand.port(), "intervale_datasets"), 2);
}

}  // namespace
}  // namespace intervale
