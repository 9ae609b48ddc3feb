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
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/parallel/all_cores.h"
#include "common/program/describe.h"
#include "common/program/program.h"
#include "common/program/progress.h"
#include "common/program/range_option.h"
#include "common/util/printable.h"
#include "server/builder/channel_builder.h"
#include "server/cli/build_input.h"
#include "server/cli/build_options.h"
#include "server/cli/describe_volume.h"
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
  const auto range = parse_range(options.range);
  if (!range) return tl::unexpected(range.error());
  if (*range) return misuse("a data set of one range under mpirun is not supported yet: build with one process");
  if (options.refine != "boundary") return misuse("--refine belongs to a range: give --range too, or --refine to extract");
  if (options.scratch && !options.memory && !options.resume)
    return misuse("--scratch belongs to a limit of memory, or to --resume: give --memory or --resume too");
  return {};
}

// What is to be built, as far as the options and the headers of the inputs say it. options: must outlive it.
Result<RankBuild> open_inputs(const BuildCommand& options, const std::vector<ChannelInput>& channels) {
  if (auto ok = check_supported(options); !ok) return tl::unexpected(ok.error());
  const auto layout = parse_layout(options);
  if (!layout) return tl::unexpected(layout.error());
  if (auto ok = check_paths(options, channels); !ok) return tl::unexpected(ok.error());
  RankBuild build;
  const auto crop = crop_of(options);
  const auto open = [&](const std::string& file, const std::optional<std::string>& part, const auto& opener) -> Result<RankInput> {
    const auto reader = opener();
    if (!reader) return tl::unexpected(reader.error());
    return RankInput{volume_name(named_volume(file, part).path), (*reader)->header(), opener, crop, options.nan};
  };
  const auto grid_of = [&](const RankInput& input) { return crop ? cropped(input.header.grid, *crop) : Result<Grid>(input.header.grid); };
  auto field = open(options.input, options.part, [&options, layout = *layout] { return open_field(options, layout); });
  if (!field) return tl::unexpected(field.error());
  const auto grid = grid_of(*field);
  if (!grid) return tl::unexpected(grid.error());
  if (auto ok = check_grid(*grid); !ok) return tl::unexpected(ok.error());
  build.field.labels = field->header.labels;
  build.input = std::move(*field);
  const auto whole = channels.empty() ? std::nullopt : whole_grid(options);
  for (const ChannelInput& channel : channels) {
    auto input = open(channel.file.string(), {}, [&options, channel, whole] { return open_channel(options, channel, whole); });
    if (!input) return tl::unexpected(input.error());
    const auto of_channel = grid_of(*input);
    if (!of_channel) return tl::unexpected(of_channel.error());
    if (auto same = check_channel_grid(channel.name, *of_channel, *grid); !same) return tl::unexpected(same.error());
    build.channels.push_back({channel.name, std::move(*input), channel.step});
  }
  build.field.name = std::filesystem::path(options.output).stem().string();
  build.field.grid = *grid;
  if (auto set = set_labels(options, build.field.labels); !set) return tl::unexpected(set.error());
  build.step = options.step;
  build.output = options.output;
  return build;
}

// What a job of as many ranks before this one has finished, if it is to be kept: a journal for each rank.
Result<std::unique_ptr<BuildCheckpoint>> open_checkpoint(const BuildCommand& options, const std::vector<ChannelInput>& channels, const Ranks& ranks) {
  if (!options.resume) return nullptr;
  const auto journal_of = [&](int rank) -> std::filesystem::path {
    std::filesystem::path beside = options.output + fmt::format(".{}-of-{}.resume", rank, ranks.size());
    if (!options.scratch) return beside;
    Fingerprint folder;
    folder.add(std::filesystem::absolute(options.output).lexically_normal().string());
    return std::filesystem::path(*options.scratch) / fmt::format("{:016x}-{}", folder.value(), beside.filename().string());
  };
  const std::filesystem::path journal = journal_of(ranks.rank());
  std::vector<std::filesystem::path> ours{options.output};
  for (int rank = 0; rank < ranks.size(); ++rank) ours.push_back(journal_of(rank));
  auto fingerprint = fingerprint_of(options, channels, ours);
  if (!fingerprint) return tl::unexpected(fingerprint.error());
  fingerprint->add(ranks.size());
  return BuildCheckpoint::open(journal, fingerprint->value(), [journal](const std::string& what) {
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
                       {"channels", to_json(d.channels)},
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
  return print(
      fmt::format("{}: {} x {} x {} samples of type {}, every range\n{}{} updates, {} supercubes, largest error {:g}, in the file {}\n"
                  "{} ranks, each with {} resident at most\nwrote {} in {:.2f} s\n",
                  printable(d.name), d.grid.dims[0], d.grid.dims[1], d.grid.dims[2], name_of(d.format.type), text_of(d.channels), built.updates,
                  built.supercubes, d.max_error, human_bytes(built.file_bytes), resident.size(),
                  human_bytes(*std::max_element(resident.begin(), resident.end())), options.output, seconds));
}

Result<void> run(const BuildCommand& options, MpiRanks& ranks) {
  const auto start = std::chrono::steady_clock::now();
  // What fails on one rank must fail on all: none may wait for it.
  const auto all_have = [&ranks](const auto& result) { return agree(ranks, result ? Result<void>() : Result<void>(tl::unexpected(result.error()))); };
  const auto channels = parse_channels(options);
  if (auto ok = all_have(channels); !ok) return ok;
  auto build = open_inputs(options, *channels);
  if (auto ok = all_have(build); !ok) return ok;
  const unsigned threads = options.threads != 0 ? options.threads : unsigned(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  Result<std::unique_ptr<ScratchMemory>> memory = nullptr;
  if (options.memory) {
    const std::string folder = std::filesystem::absolute(options.output).parent_path().string();
    memory = ScratchMemory::open(options.scratch ? *options.scratch : folder, *options.memory, threads);
  }
  if (auto ok = all_have(memory); !ok) return ok;
  if (*memory) ScratchMemory::install(**memory);
  auto checkpoint = open_checkpoint(options, *channels, ranks);
  if (auto ok = all_have(checkpoint); !ok) return ok;

  std::optional<Progress> progress;
  build->writes = remember;
  build->errors = checkpoint->get();
  build->pages = checkpoint->get();
  if (*checkpoint && ((*checkpoint)->error_scales() > 0 || (*checkpoint)->pages() > 0))
    fmt::print(stderr, "intervale: going on from '{}' and those of the other ranks\n", printable((*checkpoint)->path().string()));
  if (ranks.rank() == 0) {
    progress.emplace("building " + build->field.name);
    build->progress = [&progress](double done) { progress->fraction(done); };
    build->begins = [&progress](const std::string& channel) { progress.emplace("channel " + printable(channel)); };
  }
  const auto built = build_on_ranks(ranks, *build);
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
      auto result = run(*options, ranks);
      std::signal(SIGTERM, SIG_IGN);  // all ranks end now, and mpirun ends those that are slower
      return result;
    } catch (const std::exception& failure) {  // of this rank alone: the others wait for it
      errors.print(dynamic_cast<const std::bad_alloc*>(&failure) != nullptr ? "out of memory" : failure.what());
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
