#include "server/cli/build_options.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

#include "common/program/program.h"
#include "common/program/range_option.h"
#include "common/util/printable.h"

namespace intervale {
namespace {

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

// The two sides of NAME=VALUE.
Result<std::pair<std::string, std::string>> parse_pair(const char* option, const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    return misuse(fmt::format("{} '{}' is not NAME=...", option, printable(text)));
  return std::pair(text.substr(0, equals), text.substr(equals + 1));
}

}  // namespace

Result<std::optional<RawLayout>> parse_layout(const BuildCommand& options) {
  const bool any = !options.dims.empty() || !options.type.empty() || !options.spacing.empty() || !options.origin.empty() || !options.affine.empty() ||
                   options.big_endian || options.skip != 0;
  if (!any) return std::optional<RawLayout>{};
  if (options.dims.empty() && options.type.empty())
    return misuse("--spacing, --origin, --affine, --big-endian and --skip describe raw input, which needs --dims X Y Z and --type, too");
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

Result<void> check_output(const std::filesystem::path& input, const std::filesystem::path& output) {
  std::error_code none;
  if (std::filesystem::equivalent(input, output, none)) return misuse("the output '" + output.string() + "' is the input file: choose another name");
  for (const char* ending : {".nrrd", ".nhdr", ".raw", ".zraw", ".gz",  ".nii", ".hdr", ".img", ".mha", ".mhd", ".mrc",
                             ".map",  ".npy",  ".vtk", ".vti",  ".vtu", ".vtp", ".ply", ".stl", ".obj", ".glb", ".png"}) {
    if (output.extension() == ending) return misuse("the output '" + output.string() + "' has the extension of another format: use .ivm");
  }
  return {};
}

void add_to(Fingerprint& fingerprint, const BuildCommand& o) {
  fingerprint.add(o.range);
  fingerprint.add(o.refine);
  fingerprint.add(o.type);
  fingerprint.add(o.nan);
  fingerprint.add(o.step);
  fingerprint.add(o.dims);
  for (const auto* numbers : {&o.spacing, &o.origin, &o.affine}) fingerprint.add(*numbers);
  for (const auto* label : {&o.unit, &o.field, &o.field_unit, &o.space, &o.part}) fingerprint.add(*label);
  fingerprint.add(o.big_endian);
  fingerprint.add(o.skip);
  fingerprint.add(o.time_point);
  fingerprint.add(o.crop);
}

void add_build_options(CLI::App& command, BuildCommand& o) {
  command
      .add_option(
          "INPUT", o.input,
          "Volume: NRRD, NIfTI, MetaImage, MRC, NumPy, VTK, TIFF, DICOM, HDF5 or Zarr (also FILE:/ARRAY); a folder of TIFF or DICOM files; or raw "
          "samples (with --dims and "
          "--type)")
      ->required();
  command.add_option("-o,--output", o.output, "Interval volume to write (.ivm)")->required()->type_name("OUT.ivm");
  add_range_option(command, o.range,
                   "Closed range of values to keep: numbers, -inf or inf; LO may equal HI. Without it the data set has every range");
  command
      .add_option("--step", o.step,
                  "Distance of the values that floats are rounded to, so that each is off by S/2 at most; 0: exact. Default: exact if 65536 "
                  "steps are enough, else a power of two: 2048 to 4096 steps from the least to the greatest value")
      ->type_name("S");
  command
      .add_option("--channel", o.channels, "Another field on the same grid, a scalar or a vector of 3, that meshes can bring along; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME=FILE");
  command.add_option("--channel-step", o.channel_steps, "Like --step, of a channel; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME=S");
  command.add_option("--refine", o.refine, "What to refine: boundary: the surfaces of the range only; uniform: the inside too")
      ->check(CLI::IsMember({"boundary", "uniform"}))
      ->capture_default_str();
  command.add_option("--nan", o.nan, "Value that replaces NaN and infinite samples; without it they are an error")->type_name("VALUE");
  command.add_option("--time-point", o.time_point, "Which volume of a file with several, one for each time point; the first is 0")
      ->check([](const std::string& text) { return text.starts_with('-') ? std::string("the first time point is 0") : std::string(); }, "", "")
      ->type_name("N");
  command
      .add_option("--part,--series", o.part,
                  "Which volume of a file or folder with several, such as a DICOM series: its name, as info tells it. Of a file with several numbers "
                  "a sample, or several time points: which of them; the first is 0")
      ->type_name("NAME");
  command
      .add_option("--crop", o.crop,
                  "Samples of the input to keep, first and last on x, y and z, both included; the first is 0. They stay where they are in the world. "
                  "Only they are in memory")
      ->expected(6)
      ->type_name("I0 I1 J0 J1 K0 K1");
  command.add_option("--threads", o.threads, "Number of threads; 0: one for each core")->capture_default_str();
  command.add_option("--memory", o.memory, "Most resident memory, such as 2GiB or 500MB; what does not fit is in a scratch file. Default: no limit")
      ->transform(CLI::AsSizeValue(true))
      ->type_name("BYTES");
  command.add_option("--scratch", o.scratch, "Folder of the scratch file, and of what --resume keeps, on a disk; default: that of the output")
      ->type_name("FOLDER");
  command.add_flag("--resume", o.resume,
                   "Keep what is finished in OUT.ivm.resume, or in the scratch folder, and go on from what a build that was killed has kept there");
  command.add_option("--dims", o.dims, "Raw input: number of samples on x (fastest), y and z")->expected(3)->type_name("X Y Z");
  command.add_option("--type", o.type, "Raw input: type of a sample: u8, i8, u16, i16, u32, i32, f32 or f64")->type_name("TYPE");
  command.add_flag("--big-endian", o.big_endian, "Raw input: samples are big-endian; default: little-endian");
  command.add_option("--skip", o.skip, "Raw input: bytes to skip before the first sample")->type_name("BYTES");
  command.add_option("--spacing", o.spacing, "Raw input: distance between samples, in world units; default: 1 1 1")->expected(3)->type_name("X Y Z");
  command.add_option("--origin", o.origin, "Raw input: world position of the first sample; default: 0 0 0")->expected(3)->type_name("X Y Z");
  command
      .add_option("--affine", o.affine,
                  "Raw input: from samples to the world, instead of --spacing and --origin: 3 x 4 numbers, row by row; sample (i, j, k) is at "
                  "A (i, j, k) + T")
      ->expected(12)
      ->type_name("A11 A12 A13 T1 A21 ... T3");
  command.add_option("--unit", o.unit, "Unit of length, such as mm; default: what the input says")->type_name("UNIT");
  command.add_option("--field", o.field, "What the values are, such as density; default: what the input says")->type_name("NAME");
  command.add_option("--field-unit", o.field_unit, "Unit of the values, such as HU; default: what the input says")->type_name("UNIT");
  command.add_option("--space", o.space, "Where the axes of the world point to, such as RAS or LPS; default: what the input says")->type_name("AXES");
  add_json_flag(command, o.json);
}

}  // namespace intervale
