#include <fmt/core.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <sys/resource.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/parallel/all_cores.h"
#include "common/patch/visit_samples.h"
#include "common/program/progress.h"
#include "common/program/range_option.h"
#include "common/util/printable.h"
#include "server/builder/build_data_set.h"
#include "server/cli/commands.h"
#include "server/cli/describe_volume.h"
#include "server/scratch/scratch_memory.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"

namespace intervale {
namespace {

struct BuildCommand {
  std::string input, output;
  std::vector<std::string> range;
  std::string refine = "boundary", type;
  std::optional<double> nan, step;
  unsigned threads = 0;
  std::vector<std::int64_t> dims;
  std::vector<double> spacing, origin, affine;
  std::optional<std::string> unit, field, field_unit, space;
  std::vector<std::string> channels, channel_steps;  // NAME=FILE, NAME=S
  bool big_endian = false, json = false;
  std::uint64_t skip = 0;
  std::optional<std::uint64_t> time_point;
  std::optional<std::string> part;
  std::vector<std::int64_t> crop;  // first and last on x, on y and on z
  std::optional<std::uint64_t> memory;
  std::optional<std::string> scratch;
};

// A channel to be built.
struct ChannelInput {
  std::string name;
  std::filesystem::path file;
  std::optional<double> step;
};

Result<Affine> parse_affine(const BuildCommand& options) {
  Affine affine;
  if (!options.affine.empty()) {
    if (!options.spacing.empty() || !options.origin.empty()) return misuse("--affine says what --spacing and --origin say: give one or the other");
    std::copy_n(options.affine.begin(), 12, affine.rows.begin());
    return affine;
  }
  Vec3 spacing{1, 1, 1}, origin{};
  if (!options.spacing.empty()) std::copy_n(options.spacing.begin(), 3, spacing.begin());
  if (!options.origin.empty()) std::copy_n(options.origin.begin(), 3, origin.begin());
  if (!std::all_of(spacing.begin(), spacing.end(), [](double s) { return s > 0; }))
    return misuse("the numbers of --spacing must be greater than 0; --affine can mirror a volume");
  return Affine::of(spacing, origin);
}

Result<std::optional<RawLayout>> parse_layout(const BuildCommand& options) {
  const bool any = !options.dims.empty() || !options.type.empty() || !options.spacing.empty() || !options.origin.empty() || !options.affine.empty() ||
                   options.big_endian || options.skip != 0;
  if (!any) return std::optional<RawLayout>{};
  if (options.dims.empty() || options.type.empty()) return misuse("raw input needs both --dims X Y Z and --type");
  RawLayout layout;
  const auto type = parse_sample_type(options.type);
  if (!type) return tl::unexpected(type.error());
  layout.type = *type;
  layout.big_endian = options.big_endian;
  layout.skip_bytes = options.skip;
  std::copy_n(options.dims.begin(), 3, layout.dims.begin());
  const auto affine = parse_affine(options);
  if (!affine) return tl::unexpected(affine.error());
  layout.affine = *affine;
  return std::optional(layout);
}

std::optional<SampleBox> crop_of(const BuildCommand& options) {
  if (options.crop.empty()) return {};
  SampleBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.first[axis] = options.crop[2 * axis];
    box.last[axis] = options.crop[2 * axis + 1];
  }
  return box;
}

// What the options say instead of the input.
Result<void> set_labels(const BuildCommand& options, Labels& labels) {
  const auto set = [](const char* name, const std::optional<std::string>& text, std::string& label) -> Result<void> {
    if (!text) return {};
    if (!is_label(*text)) return misuse(fmt::format("{} needs UTF-8 of at most {} bytes, without control characters", name, kMaxLabel));
    label = *text;
    return {};
  };
  if (auto ok = set("--unit", options.unit, labels.unit); !ok) return ok;
  if (auto ok = set("--field", options.field, labels.field); !ok) return ok;
  if (auto ok = set("--space", options.space, labels.space); !ok) return ok;
  return set("--field-unit", options.field_unit, labels.field_unit);
}

// The two sides of NAME=VALUE.
Result<std::pair<std::string, std::string>> parse_pair(const char* option, const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    return misuse(fmt::format("{} '{}' is not NAME=...", option, printable(text)));
  return std::pair(text.substr(0, equals), text.substr(equals + 1));
}

Result<std::vector<ChannelInput>> parse_channels(const BuildCommand& options) {
  std::vector<ChannelInput> channels;
  const auto find = [&channels](const std::string& name) {
    return std::find_if(channels.begin(), channels.end(), [&name](const ChannelInput& channel) { return channel.name == name; });
  };
  for (const std::string& text : options.channels) {
    const auto pair = parse_pair("--channel", text);
    if (!pair) return tl::unexpected(pair.error());
    if (!is_channel_name(pair->first))
      return misuse(fmt::format("--channel needs a name of at most {} bytes of UTF-8, other than surface, value and range", kMaxLabel));
    if (find(pair->first) != channels.end()) return misuse("two channels are named '" + pair->first + "'");
    channels.push_back({pair->first, pair->second, {}});
  }
  if (channels.size() > kMaxChannels) return misuse(fmt::format("at most {} channels", kMaxChannels));
  for (const std::string& text : options.channel_steps) {
    const auto pair = parse_pair("--channel-step", text);
    if (!pair) return tl::unexpected(pair.error());
    const auto channel = find(pair->first);
    if (channel == channels.end()) return misuse("--channel-step: no channel is named '" + printable(pair->first) + "'");
    double step = 0;
    const char* const end = pair->second.data() + pair->second.size();
    if (const auto [at, error] = std::from_chars(pair->second.data(), end, step); error != std::errc() || at != end)
      return misuse("--channel-step: '" + printable(pair->second) + "' is not a number");
    channel->step = step;
  }
  return channels;
}

std::string text_of_dims(const std::string& who, const Grid& grid) {
  return fmt::format("{} has {} x {} x {} samples", who, grid.dims[0], grid.dims[1], grid.dims[2]);
}

// The channels of a data set of this grid and set.
Result<BuiltChannels> build_channels(const std::vector<ChannelInput>& inputs, const BuildCommand& options, const Grid& grid,
                                     const SupercubeSet& set) {
  BuiltChannels built;
  std::optional<Grid> whole;  // of the field, before it was cropped
  if (!options.dims.empty()) {
    whole.emplace();
    std::copy_n(options.dims.begin(), 3, whole->dims.begin());
  } else if (const NamedVolume field = named_volume(options.input, options.part); !options.crop.empty() && !inputs.empty()) {
    const auto header = read_volume_header(field.path, field.part);
    if (header && *header) whole = (*header)->grid;
  }
  for (const ChannelInput& input : inputs) {
    Progress progress("channel " + printable(input.name));
    NamedVolume named = named_volume(input.file.string());
    const auto header = read_volume_header(named.path, named.part);
    const bool has_several = header && *header && (*header)->time_points > 1, has_parts = header && *header && !(*header)->parts.empty();
    if (has_parts && !named.part) named.part = options.part;
    if (whole && header && *header && (*header)->grid.dims != whole->dims)
      return fail(text_of_dims("channel '" + printable(input.name) + "'", (*header)->grid) + text_of_dims(", the field", *whole));
    auto volume =
        read_volume(named.path, {}, has_several && !(*header)->time_point ? options.time_point : std::nullopt, named.part, crop_of(options));
    if (!volume) return tl::unexpected(volume.error());
    if (auto added = add_channel(built, *volume, input.name, input.step, options.nan, grid, set); !added) return tl::unexpected(added.error());
  }
  return built;
}

// Protects the input, and files of other kinds, from being overwritten by mistake.
Result<void> check_output(const std::filesystem::path& input, const std::filesystem::path& output) {
  std::error_code none;
  if (std::filesystem::equivalent(input, output, none)) return misuse("the output '" + output.string() + "' is the input file: choose another name");
  for (const char* ending : {".nrrd", ".nhdr", ".raw", ".zraw", ".gz",  ".nii", ".hdr", ".img", ".mha", ".mhd", ".mrc",
                             ".map",  ".npy",  ".vtk", ".vti",  ".vtu", ".vtp", ".ply", ".stl", ".obj", ".glb", ".png"}) {
    if (output.extension() == ending) return misuse("the output '" + output.string() + "' has the extension of another format: use .ivm");
  }
  return {};
}

std::string text_of_values(const Volume& volume) {
  return visit_samples(volume, [](auto samples) {
    const auto [least, greatest] = std::minmax_element(samples.begin(), samples.end());
    return fmt::format("{:g} to {:g}", double(*least), double(*greatest));
  });
}

// Of one range.
Result<nlohmann::ordered_json> write_range(const BuildCommand& options, const std::vector<ChannelInput>& inputs, Volume& volume, const Range& range,
                                           std::string& text) {
  const std::string values = text_of_values(volume);
  Result<IntervalVolume> made = fail("");
  {
    Progress progress("building " + volume.name);
    const Refine refine = options.refine == "uniform" ? Refine::uniform : Refine::boundary;
    made = build_range(volume, {range, refine, [&](double done) { progress.fraction(done); }}, options.step);
  }
  if (!made) return tl::unexpected(made.error());
  auto built = build_channels(inputs, options, volume.grid, made->set());
  if (!built) return tl::unexpected(built.error());
  if (auto set = made->set_channels(std::move(built->channels), std::move(built->keys)); !set) return tl::unexpected(set.error());
  if (auto saved = save_ivm(options.output, *made, on_all_cores); !saved) return tl::unexpected(saved.error());
  if (made->description().full.tets == 0 && made->description().full.vertices == 0) {
    fmt::print(stderr, "intervale: warning: no part of the volume lies in the range; its values are {}\n", values);
  }
  text = text_of(*made, file_size_of(options.output)) + "values " + values + "\n";
  return stats_of(*made, file_size_of(options.output));
}

// Of every range.
Result<nlohmann::ordered_json> write_every_range(const BuildCommand& options, const std::vector<ChannelInput>& inputs, Volume& volume,
                                                 std::string& text) {
  Progress progress("building " + volume.name);
  auto parts = build_every_range(volume, options.step, [&](double done) { progress.fraction(done); });
  if (!parts) return tl::unexpected(parts.error());
  auto built = build_channels(inputs, options, volume.grid, parts->set);
  if (!built) return tl::unexpected(built.error());
  parts->description.channels = std::move(built->channels);
  parts->channel_keys = std::move(built->keys);
  const ValueVolume made(std::move(*parts));
  if (auto saved = save_values(options.output, made, on_all_cores); !saved) return tl::unexpected(saved.error());
  text = text_of(made, file_size_of(options.output));
  return stats_of(made, file_size_of(options.output));
}

// Where large arrays lie from now on, if there is a budget.
Result<std::unique_ptr<ScratchMemory>> limit_memory(const BuildCommand& options, const std::filesystem::path& folder, unsigned threads) {
  if (!options.memory) {
    if (options.scratch) return misuse("--scratch belongs to a limit of memory: give --memory too");
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
  const auto range = parse_range(options.range);
  if (!range) return tl::unexpected(range.error());
  if (!*range && options.refine != "boundary") return misuse("--refine belongs to a range: give --range too, or --refine to extract");
  const auto layout = parse_layout(options);
  if (!layout) return tl::unexpected(layout.error());
  const auto channels = parse_channels(options);
  if (!channels) return tl::unexpected(channels.error());
  Labels labels;
  if (auto valid = set_labels(options, labels); !valid) return valid;
  // Before the long computation, not after it.
  const std::filesystem::path folder = std::filesystem::absolute(options.output).parent_path();
  if (!std::filesystem::is_directory(folder))
    return fail("cannot write '" + options.output + "': the folder '" + folder.string() + "' does not exist");
  const NamedVolume input = named_volume(options.input, options.part);
  if (auto output = check_output(input.path, options.output); !output) return output;
  for (const ChannelInput& channel : *channels) {
    if (auto output = check_output(named_volume(channel.file.string()).path, options.output); !output) return output;
  }

  const unsigned threads = options.threads != 0 ? options.threads : unsigned(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const auto memory = limit_memory(options, folder, threads);
  if (!memory) return tl::unexpected(memory.error());
  auto volume = read_volume(input.path, *layout, options.time_point, input.part, crop_of(options));
  if (!volume) return tl::unexpected(volume.error());
  if (volume->components != 1)
    return misuse("'" + options.input + "' has vectors: choose a component with --part 0, 1 or 2; --channel reads all of it");
  const auto crop = crop_of(options);
  if (auto finite = check_finite(*volume, options.nan, crop ? crop->first : SampleBox{}.first); !finite) return finite;
  if (auto set = set_labels(options, volume->labels); !set) return set;
  volume->name = std::filesystem::path(options.output).stem().string();

  std::string text;
  auto stats = *range ? write_range(options, *channels, *volume, **range, text) : write_every_range(options, *channels, *volume, text);
  if (!stats) return tl::unexpected(stats.error());
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
  command
      .add_option(
          "INPUT", o->input,
          "Volume: NRRD, NIfTI, MetaImage, MRC, NumPy, VTK, TIFF, DICOM, HDF5 or Zarr (also FILE:/ARRAY); a folder of TIFF or DICOM files; or raw "
          "samples (with --dims and "
          "--type)")
      ->required();
  command.add_option("-o,--output", o->output, "Interval volume to write (.ivm)")->required()->type_name("OUT.ivm");
  add_range_option(command, o->range,
                   "Closed range of values to keep: numbers, -inf or inf; LO may equal HI. Without it the data set has every range");
  command
      .add_option("--step", o->step,
                  "Distance of the values that floats are rounded to, so that each is off by S/2 at most; 0: exact. Default: exact if 65536 "
                  "steps are enough, else a power of two: 2048 to 4096 steps from the least to the greatest value")
      ->type_name("S");
  command
      .add_option("--channel", o->channels, "Another field on the same grid, a scalar or a vector of 3, that meshes can bring along; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME=FILE");
  command.add_option("--channel-step", o->channel_steps, "Like --step, of a channel; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME=S");
  command.add_option("--refine", o->refine, "What to refine: boundary: the surfaces of the range only; uniform: the inside too")
      ->check(CLI::IsMember({"boundary", "uniform"}))
      ->capture_default_str();
  command.add_option("--nan", o->nan, "Value that replaces NaN and infinite samples; without it they are an error")->type_name("VALUE");
  command.add_option("--time-point", o->time_point, "Which volume of a file with several, one for each time point; the first is 0")
      ->check([](const std::string& text) { return text.starts_with('-') ? std::string("the first time point is 0") : std::string(); }, "", "")
      ->type_name("N");
  command
      .add_option("--part,--series", o->part,
                  "Which volume of a file or folder with several, such as a DICOM series: its name, as info tells it. Of a file with several numbers "
                  "a sample, or several time points: which of them; the first is 0")
      ->type_name("NAME");
  command
      .add_option("--crop", o->crop,
                  "Samples of the input to keep, first and last on x, y and z, both included; the first is 0. They stay where they are in the world. "
                  "Only they are in memory")
      ->expected(6)
      ->type_name("I0 I1 J0 J1 K0 K1");
  command.add_option("--threads", o->threads, "Number of threads; 0: one for each core")->capture_default_str();
  command.add_option("--memory", o->memory, "Most resident memory, such as 2GiB or 500MB; what does not fit is in a scratch file. Default: no limit")
      ->transform(CLI::AsSizeValue(true))
      ->type_name("BYTES");
  command.add_option("--scratch", o->scratch, "Folder of the scratch file, on a disk; default: that of the output")->type_name("FOLDER");
  command.add_option("--dims", o->dims, "Raw input: number of samples on x (fastest), y and z")->expected(3)->type_name("X Y Z");
  command.add_option("--type", o->type, "Raw input: type of a sample: u8, i8, u16, i16, u32, i32, f32 or f64")->type_name("TYPE");
  command.add_flag("--big-endian", o->big_endian, "Raw input: samples are big-endian; default: little-endian");
  command.add_option("--skip", o->skip, "Raw input: bytes to skip before the first sample")->type_name("BYTES");
  command.add_option("--spacing", o->spacing, "Raw input: distance between samples, in world units; default: 1 1 1")->expected(3)->type_name("X Y Z");
  command.add_option("--origin", o->origin, "Raw input: world position of the first sample; default: 0 0 0")->expected(3)->type_name("X Y Z");
  command
      .add_option("--affine", o->affine,
                  "Raw input: from samples to the world, instead of --spacing and --origin: 3 x 4 numbers, row by row; sample (i, j, k) is at "
                  "A (i, j, k) + T")
      ->expected(12)
      ->type_name("A11 A12 A13 T1 A21 ... T3");
  command.add_option("--unit", o->unit, "Unit of length, such as mm; default: what the input says")->type_name("UNIT");
  command.add_option("--field", o->field, "What the values are, such as density; default: what the input says")->type_name("NAME");
  command.add_option("--field-unit", o->field_unit, "Unit of the values, such as HU; default: what the input says")->type_name("UNIT");
  command.add_option("--space", o->space, "Where the axes of the world point to, such as RAS or LPS; default: what the input says")
      ->type_name("AXES");
  add_json_flag(command, o->json);
}

}  // namespace intervale
