// intervale-mpi: what `intervale build` becomes under mpirun (server/cli/mpi_program.h).
//
// Every rank runs it. Only rank 0 writes to the standard output and the standard error; a rank that fails alone says so, and
// ends all.
#include <fcntl.h>
#include <fmt/core.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/parallel/all_cores.h"
#include "common/program/program.h"
#include "common/program/progress.h"
#include "common/program/range_option.h"
#include "common/util/printable.h"
#include "server/cli/build_options.h"
#include "server/cluster/build_on_ranks.h"
#include "server/mpi/mpi_ranks.h"
#include "server/resume/build_checkpoint.h"
#include "server/scratch/scratch_memory.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"
#include "server/volume/volume_reader.h"

namespace intervale {
namespace {

std::array<char, 4096> temporary_file{};  // that a signal leaves to be removed

// mpirun ends the ranks that are left by SIGTERM. The standard error is that of rank 0.
void on_end(int signal) {
  constexpr std::string_view kLine = "intervale: the job is ended: a rank has failed or was killed, or the job was cancelled\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kLine.data(), kLine.size());
  if (temporary_file[0] != 0) ::unlink(temporary_file.data());
  ::_exit(128 + signal);
}

void remember(const std::filesystem::path& temporary) {
  const std::string name = temporary.string();
  if (name.size() >= temporary_file.size()) return;
  temporary_file[0] = 0;
  if (name.empty()) return;
  std::memcpy(temporary_file.data() + 1, name.c_str() + 1, name.size());
  temporary_file[0] = name[0];  // last: a handler sees all of it or nothing
}

// The standard error of this rank while its output is silenced.
class OwnErrors {
 public:
  explicit OwnErrors(int rank) : rank_(rank), file_(::dup(STDERR_FILENO)) {
    if (rank == 0) return;
    const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    ::dup2(nothing, STDOUT_FILENO);
    ::dup2(nothing, STDERR_FILENO);
    ::close(nothing);
  }
  void print(const std::string& text) const {
    const std::string line = fmt::format("intervale: rank {}: {}\n", rank_, text);
    if (::write(file_, line.data(), line.size()) < 0) return;
  }

 private:
  int rank_, file_;
};

Result<void> check_supported(const BuildCommand& options) {
  const auto refuse = [](const char* what) { return misuse(std::string(what) + " under mpirun is not supported yet: build with one process"); };
  const auto range = parse_range(options.range);
  if (!range) return tl::unexpected(range.error());
  if (*range) return refuse("a data set of one range");
  if (options.refine != "boundary") return misuse("--refine belongs to a range: give --range too, or --refine to extract");
  if (!options.channels.empty() || !options.channel_steps.empty()) return refuse("--channel");
  if (!options.crop.empty()) return refuse("--crop");
  if (options.scratch && !options.memory && !options.resume)
    return misuse("--scratch belongs to a limit of memory, or to --resume: give --memory or --resume too");
  const std::filesystem::path folder = std::filesystem::absolute(options.output).parent_path();
  if (!std::filesystem::is_directory(folder))
    return fail("cannot write '" + options.output + "': the folder '" + folder.string() + "' does not exist");
  return check_output(named_volume(options.input, options.part).path, options.output);
}

// What is to be built, as far as the header of the input says it.
struct Input {
  NamedVolume named;
  std::optional<RawLayout> layout;
  RankBuild build;
};

Result<Volume> read_box(const BuildCommand& options, const Input& input, const SampleBox& box) {
  auto volume = read_volume(input.named.path, input.layout, options.time_point, input.named.part, box);
  if (!volume) return volume;
  if (auto finite = check_finite(*volume, options.nan, box.first); !finite) return tl::unexpected(finite.error());
  return volume;
}

Result<Input> open_input(const BuildCommand& options) {
  if (auto ok = check_supported(options); !ok) return tl::unexpected(ok.error());
  const auto layout = parse_layout(options);
  if (!layout) return tl::unexpected(layout.error());
  Input input{named_volume(options.input, options.part), *layout, {}};
  const auto reader = open_volume(input.named.path, input.layout, options.time_point, input.named.part);
  if (!reader) return tl::unexpected(reader.error());
  const VolumeHeader& header = (*reader)->header();
  if (header.encoding != Encoding::raw || header.base64_skip || header.slope != 1 || header.intercept != 0)
    return misuse("under mpirun, samples must lie in their file as they are, neither compressed nor to be rescaled: convert '" + options.input +
                  "', or build with one process");
  if (header.components != 1 && !header.component)
    return misuse("'" + options.input + "' has vectors: choose a component with --part 0, 1 or 2; --channel reads all of it");
  RankBuild& build = input.build;
  build.field.name = std::filesystem::path(options.output).stem().string();
  build.field.grid = header.grid;
  build.field.labels = header.labels;
  build.type = header.type;
  build.step = options.step;
  build.output = options.output;
  if (auto ok = check_grid(header.grid); !ok) return tl::unexpected(ok.error());
  if (auto set = set_labels(options, build.field.labels); !set) return tl::unexpected(set.error());
  return input;
}

// What a job of as many ranks before this one has finished, if it is to be kept: a journal for each rank.
Result<std::unique_ptr<BuildCheckpoint>> open_checkpoint(const BuildCommand& options, const Ranks& ranks) {
  if (!options.resume) return nullptr;
  std::filesystem::path journal = options.output + fmt::format(".{}-of-{}.resume", ranks.rank(), ranks.size());
  Fingerprint fingerprint;
  if (options.scratch) {
    Fingerprint folder;
    folder.add(std::filesystem::absolute(options.output).lexically_normal().string());
    journal = std::filesystem::path(*options.scratch) / fmt::format("{:016x}-{}", folder.value(), journal.filename().string());
  }
  add_to(fingerprint, options);
  fingerprint.add(ranks.size());
  const NamedVolume input = named_volume(options.input, options.part);
  fingerprint.add(input.part);
  const std::array<std::filesystem::path, 2> ours{options.output, journal};
  if (auto ok = fingerprint.add_input(input.path, ours); !ok) return tl::unexpected(ok.error());
  return BuildCheckpoint::open(journal, fingerprint.value(), [journal](const std::string& what) {
    fmt::print(stderr, "intervale: warning: '{}' {}\n", printable(journal.string()), what);
  });
}

std::uint64_t most_resident_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * 1024;
}

Result<void> tell(const BuildCommand& options, const BuiltByRanks& built, const std::vector<std::uint64_t>& resident, double seconds) {
  const FieldDescription& d = built.field;
  if (options.json) {
    return print_json({{"name", d.name},
                       {"scope", "every"},
                       {"type", name_of(d.format.type)},
                       {"values", {{"least", d.format.least()}, {"greatest", d.format.greatest()}}},
                       {"step", d.is_exact ? 0.0 : d.format.step},
                       {"max_error", d.max_error},
                       {"updates", built.updates},
                       {"supercubes", built.supercubes},
                       {"file_bytes", built.file_bytes},
                       {"ranks", resident.size()},
                       {"resident_bytes", resident},
                       {"seconds", seconds}});
  }
  return print(fmt::format(
      "{}: {} x {} x {} samples of type {}, every range\n{} updates, {} supercubes, largest error {:g}, in the file {}\n"
      "{} ranks, each with {} resident at most\nwrote {} in {:.2f} s\n",
      printable(d.name), d.grid.dims[0], d.grid.dims[1], d.grid.dims[2], name_of(d.format.type), built.updates, built.supercubes, d.max_error,
      human_bytes(built.file_bytes), resident.size(), human_bytes(*std::max_element(resident.begin(), resident.end())), options.output, seconds));
}

Result<void> run(const BuildCommand& options, MpiRanks& ranks) {
  const auto start = std::chrono::steady_clock::now();
  // What fails on one rank must fail on all: none may wait for it.
  const auto all_have = [&ranks](const auto& result) { return agree(ranks, result ? Result<void>() : Result<void>(tl::unexpected(result.error()))); };
  auto input = open_input(options);
  if (auto ok = all_have(input); !ok) return ok;
  const unsigned threads = options.threads != 0 ? options.threads : unsigned(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  Result<std::unique_ptr<ScratchMemory>> memory = nullptr;
  if (options.memory) {
    const std::string folder = std::filesystem::absolute(options.output).parent_path().string();
    memory = ScratchMemory::open(options.scratch ? *options.scratch : folder, *options.memory, threads);
  }
  if (auto ok = all_have(memory); !ok) return ok;
  if (*memory) ScratchMemory::install(**memory);
  auto checkpoint = open_checkpoint(options, ranks);
  if (auto ok = all_have(checkpoint); !ok) return ok;

  std::optional<Progress> progress;
  RankBuild& build = input->build;
  build.read_box = [&](const SampleBox& box) { return read_box(options, *input, box); };
  build.writes = remember;
  build.errors = checkpoint->get();
  build.pages = checkpoint->get();
  if (*checkpoint && ((*checkpoint)->error_scales() > 0 || (*checkpoint)->pages() > 0))
    fmt::print(stderr, "intervale: going on from '{}' and those of the other ranks\n", printable((*checkpoint)->path().string()));
  if (ranks.rank() == 0) {
    progress.emplace("building " + build.field.name);
    build.progress = [&progress](double done) { progress->fraction(done); };
  }
  const auto built = build_on_ranks(ranks, build);
  progress.reset();
  if (!built) return tl::unexpected(built.error());
  if (*checkpoint) (*checkpoint)->remove();
  const std::uint64_t own = most_resident_bytes();
  const auto resident = joined<std::uint64_t>(ranks, std::span(&own, 1));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return ranks.rank() == 0 ? tell(options, *built, resident, seconds) : Result<void>();
}

int run_program(int argc, char** argv) {
  const AllCores all_cores;
  MpiRanks ranks(argc, argv);
  std::signal(SIGTERM, on_end);
  const OwnErrors errors(ranks.rank());
  Program program("intervale", "Build an interval volume on several ranks");
  const auto options = std::make_shared<BuildCommand>();
  CLI::App& command = program.add_command("build", "Build an interval volume of every range from a volume", [&] {
    try {
      return run(*options, ranks);
    } catch (const std::exception& failure) {  // of this rank alone: the others wait for it
      errors.print(failure.what());
      if (temporary_file[0] != 0) ::unlink(temporary_file.data());
      MpiRanks::abort(kExitFailed);
    }
  });
  add_build_options(command, *options);
  return program.run(argc, argv);
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) { return intervale::run_program(argc, argv); }
