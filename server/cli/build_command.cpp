#include <fmt/core.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_page.h"
#include "common/parallel/all_cores.h"
#include "common/patch/visit_samples.h"
#include "common/program/progress.h"
#include "common/program/range_option.h"
#include "common/remote/remote_url.h"
#include "common/util/printable.h"
#include "server/builder/build_data_set.h"
#include "server/cli/build_input.h"
#include "server/cli/build_options.h"
#include "server/cli/commands.h"
#include "server/cli/describe_volume.h"
#include "server/resume/build_checkpoint.h"
#include "server/resume/fingerprint.h"
#include "server/scratch/scratch_memory.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_reader.h"

namespace intervale {
namespace {

// A build, and where it keeps what is finished.
struct Build {
  const BuildCommand& options;
  const std::optional<RawLayout>& layout;
  const std::vector<ChannelInput>& channels;
  BuildCheckpoint* checkpoint;                                                                              // null: nowhere
  [[nodiscard]] std::string name() const { return std::filesystem::path(options.output).stem().string(); }  // of the data set
};

// The field, its samples finite.
Result<Volume> read_field(const Build& build) {
  const BuildCommand& options = build.options;
  const auto reader = open_field(options, build.layout);
  if (!reader) return tl::unexpected(reader.error());
  const auto crop = crop_of(options);
  auto volume = read_samples(**reader, crop);
  if (!volume) return volume;
  volume->name = volume_name(named_volume(options.input, options.part).path);
  if (auto finite = check_finite(*volume, options.nan, crop ? crop->first : SampleBox{}.first); !finite) return tl::unexpected(finite.error());
  if (auto set = set_labels(options, volume->labels); !set) return tl::unexpected(set.error());
  volume->name = build.name();
  return volume;
}

// The channels of a data set of this grid and set that a build before this one has finished, by number.
using KnownChannels = std::vector<std::optional<BuildCheckpoint::KeptChannel>>;
KnownChannels take_channels(const Build& build, const SupercubeSet& set) {
  KnownChannels known(build.channels.size());
  if (build.checkpoint == nullptr) return known;
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = build.checkpoint->take_channel(std::uint32_t(i), set);
  return known;
}

// Says what is known besides the values of the field.
void tell_of_resumption(const Build& build, const SupercubeSet& set, const KnownChannels& channels) {
  std::size_t known = 0, values = 1;
  for (const auto& channel : channels) {
    known += std::size_t(channel.has_value());
    if (channel) values += channel->keys.size();
  }
  std::string text = "values known";
  if (!channels.empty()) text += fmt::format(", {} of {} channels known", known, channels.size());
  if (known == channels.size()) text += fmt::format(", {} of {} pages compressed", build.checkpoint->pages(), pages_of(set).size() * values);
  fmt::print(stderr, "intervale: going on from '{}': {}\n", printable(build.checkpoint->path().string()), text);
}

// The same, as long as the values are not known.
void tell_of_errors(const Build& build) {
  if (build.checkpoint == nullptr || build.checkpoint->error_scales() == 0) return;
  fmt::print(stderr, "intervale: going on from '{}': errors of {} scales known\n", printable(build.checkpoint->path().string()),
             build.checkpoint->error_scales());
}

// The samples of a channel. whole: as of open_channel().
Result<Volume> read_channel(const BuildCommand& options, const ChannelInput& input, const std::optional<Grid>& whole) {
  const auto reader = open_channel(options, input, whole);
  if (!reader) return tl::unexpected(reader.error());
  auto volume = read_samples(**reader, crop_of(options));
  if (volume) volume->name = volume_name(named_volume(input.file.string()).path);
  return volume;
}

// The channels of a data set of this grid and set.
Result<BuiltChannels> build_channels(const Build& build, const Grid& grid, const SupercubeSet& set, KnownChannels known) {
  const BuildCommand& options = build.options;
  BuiltChannels built;
  const std::optional<Grid> whole = build.channels.empty() ? std::nullopt : whole_grid(options);
  for (std::size_t i = 0; i < build.channels.size(); ++i) {
    if (known[i]) {
      built.channels.push_back(std::move(known[i]->channel));
      built.keys.push_back(std::move(known[i]->keys));
      continue;
    }
    const ChannelInput& input = build.channels[i];
    Progress progress("channel " + printable(input.name));
    auto volume = read_channel(options, input, whole);
    if (!volume) return tl::unexpected(volume.error());
    if (auto added = add_channel(built, *volume, input.name, input.step, options.nan, grid, set); !added) return tl::unexpected(added.error());
    if (build.checkpoint != nullptr) build.checkpoint->keep_channel(std::uint32_t(i), built.channels.back(), built.keys.back());
  }
  return built;
}

std::string text_of_values(const Volume& volume) {
  return visit_samples(volume, [](auto samples) {
    const auto [least, greatest] = std::minmax_element(samples.begin(), samples.end());
    return fmt::format("{:g} to {:g}", double(*least), double(*greatest));
  });
}

// The parts of a data set of one range, without channels; values: what is told of the field's.
Result<IntervalVolume::Parts> make_range(const Build& build, const Range& range, std::string& values) {
  tell_of_errors(build);
  auto volume = read_field(build);
  if (!volume) return tl::unexpected(volume.error());
  values = text_of_values(*volume);
  Progress progress("building " + volume->name);
  const Refine refine = build.options.refine == "uniform" ? Refine::uniform : Refine::boundary;
  auto made = build_range(*volume, {range, refine, [&](double done) { progress.fraction(done); }, build.checkpoint}, build.options.step);
  if (made && build.checkpoint != nullptr) build.checkpoint->keep_one_range(*made, values);
  return made;
}

// Of one range.
Result<nlohmann::ordered_json> write_range(const Build& build, const Range& range, std::string& text) {
  std::string values;
  Result<IntervalVolume::Parts> parts = fail("");
  KnownChannels known(build.channels.size());
  if (auto kept = build.checkpoint != nullptr ? build.checkpoint->take_one_range() : std::nullopt) {
    values = std::move(kept->values);
    parts = std::move(kept->parts);
    parts->description.name = build.name();
    known = take_channels(build, parts->set);
    tell_of_resumption(build, parts->set, known);
  } else {
    parts = make_range(build, range, values);
  }
  if (!parts) return tl::unexpected(parts.error());
  auto made = IntervalVolume::assemble(std::move(*parts));
  if (!made) return tl::unexpected(made.error());
  auto built = build_channels(build, made->description().grid, made->set(), std::move(known));
  if (!built) return tl::unexpected(built.error());
  if (auto set = made->set_channels(std::move(built->channels), std::move(built->keys)); !set) return tl::unexpected(set.error());
  if (auto saved = save_ivm(build.options.output, *made, on_all_cores, build.checkpoint); !saved) return tl::unexpected(saved.error());
  if (made->description().full.tets == 0 && made->description().full.vertices == 0) {
    fmt::print(stderr, "intervale: warning: no part of the volume lies in the range; its values are {}\n", values);
  }
  text = text_of(*made, file_size_of(build.options.output)) + "values " + values + "\n";
  return stats_of(*made, file_size_of(build.options.output));
}

// The parts of a data set of every range, without channels.
Result<ValueVolume::Parts> make_every_range(const Build& build, Progress& progress) {
  tell_of_errors(build);
  auto volume = read_field(build);
  if (!volume) return tl::unexpected(volume.error());
  auto made = build_every_range(
      *volume, build.options.step, [&](double done) { progress.fraction(done); }, build.checkpoint);
  if (made && build.checkpoint != nullptr) build.checkpoint->keep_every_range(*made);
  return made;
}

// Of every range.
Result<nlohmann::ordered_json> write_every_range(const Build& build, std::string& text) {
  Progress progress("building " + build.name());
  Result<ValueVolume::Parts> parts = fail("");
  KnownChannels known(build.channels.size());
  if (auto kept = build.checkpoint != nullptr ? build.checkpoint->take_every_range() : std::nullopt) {
    parts = std::move(*kept);
    parts->description.name = build.name();
    known = take_channels(build, parts->set);
    tell_of_resumption(build, parts->set, known);
  } else {
    parts = make_every_range(build, progress);
  }
  if (!parts) return tl::unexpected(parts.error());
  auto built = build_channels(build, parts->description.grid, parts->set, std::move(known));
  if (!built) return tl::unexpected(built.error());
  parts->description.channels = std::move(built->channels);
  parts->channel_keys = std::move(built->keys);
  const ValueVolume made(std::move(*parts));
  if (auto saved = save_values(build.options.output, made, on_all_cores, build.checkpoint); !saved) return tl::unexpected(saved.error());
  const ValueSummary summary = summary_of(made, file_size_of(build.options.output));
  text = text_of(summary);
  return stats_of(summary);
}

// The journal of a build: beside the output, or in the scratch folder, where the outputs of other folders have other names.
std::filesystem::path journal_of(const BuildCommand& options) {
  if (!options.scratch) return options.output + ".resume";
  Fingerprint folder;
  folder.add(std::filesystem::absolute(options.output).lexically_normal().string());
  return std::filesystem::path(*options.scratch) /
         fmt::format("{}-{:016x}.resume", std::filesystem::path(options.output).filename().string(), folder.value());
}

// What a build before this one has finished, if it is to be kept.
Result<std::unique_ptr<BuildCheckpoint>> open_checkpoint(const BuildCommand& options, const std::vector<ChannelInput>& channels) {
  if (!options.resume) return nullptr;
  const std::filesystem::path journal = journal_of(options);
  const std::array<std::filesystem::path, 2> ours{options.output, journal};
  const auto fingerprint = fingerprint_of(options, channels, ours);
  if (!fingerprint) return tl::unexpected(fingerprint.error());
  return BuildCheckpoint::open(journal, fingerprint->value(), [journal](const std::string& what) {
    fmt::print(stderr, "intervale: warning: '{}' {}\n", printable(journal.string()), what);
  });
}

// Where large arrays lie from now on, if there is a budget.
Result<std::unique_ptr<ScratchMemory>> limit_memory(const BuildCommand& options, const std::filesystem::path& folder, unsigned threads) {
  if (!options.memory) {
    if (options.scratch && !options.resume) return misuse("--scratch belongs to a limit of memory, or to --resume: give --memory or --resume too");
    return nullptr;
  }
  auto memory = ScratchMemory::open(options.scratch ? *options.scratch : folder.string(), *options.memory, threads);
  if (memory) ScratchMemory::install(**memory);
  return memory;
}

std::uint64_t most_resident_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * 1024;
}

Result<void> run(const BuildCommand& options) {
  const auto start = std::chrono::steady_clock::now();
  if (is_remote_url(options.input)) return misuse("volumes are read from files, not from URLs: download '" + printable(options.input) + "' first");
  const auto range = parse_range(options.range);
  if (!range) return tl::unexpected(range.error());
  if (!*range && options.refine != "boundary") return misuse("--refine belongs to a range: give --range too, or --refine to extract");
  const auto layout = parse_layout(options);
  if (!layout) return tl::unexpected(layout.error());
  const auto channels = parse_channels(options);
  if (!channels) return tl::unexpected(channels.error());
  // Before the long computation, not after it.
  if (auto valid = check_paths(options, *channels); !valid) return valid;

  const unsigned threads = options.threads != 0 ? options.threads : unsigned(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const auto memory = limit_memory(options, std::filesystem::absolute(options.output).parent_path(), threads);
  if (!memory) return tl::unexpected(memory.error());
  const auto checkpoint = open_checkpoint(options, *channels);
  if (!checkpoint) return tl::unexpected(checkpoint.error());
  const Build build{options, *layout, *channels, checkpoint->get()};
  std::string text;
  auto stats = *range ? write_range(build, **range, text) : write_every_range(build, text);
  if (!stats) return tl::unexpected(stats.error());
  if (*checkpoint) (*checkpoint)->remove();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (options.json) {
    (*stats)["seconds"] = seconds;
    if (*memory) {
      (*stats)["resident_bytes"] = most_resident_bytes();
      (*stats)["scratch_bytes"] = (*memory)->most_bytes();
    }
    return print_json(*stats);
  }
  if (*memory)
    text += fmt::format("{} resident at most, {} in the scratch file\n", human_bytes(most_resident_bytes()), human_bytes((*memory)->most_bytes()));
  return print(text + fmt::format("wrote {} in {:.2f} s\n", options.output, seconds));
}

}  // namespace

void add_build_command(Program& program) {
  const auto o = std::make_shared<BuildCommand>();
  CLI::App& command = program.add_command("build", "Build an interval volume from a volume, for a range of values or for every range", [o] {
    try {
      return run(*o);
    } catch (const ScratchFull& full) {
      return Result<void>(fail(full.what()));
    }
  });
  add_build_options(command, *o);
}

}  // namespace intervale
