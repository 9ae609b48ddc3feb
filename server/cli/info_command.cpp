#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <utility>

#include "common/ivm/extraction.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_verify.h"
#include "common/ivm/verify.h"
#include "common/mesh/mesh.h"
#include "common/parallel/all_cores.h"
#include "common/program/progress.h"
#include "common/program/range_option.h"
#include "common/ranges/find_relevant_updates.h"
#include "common/remote/load_remote.h"
#include "common/remote/read_remote.h"
#include "common/remote/remote_options.h"
#include "common/util/printable.h"
#include "common/view/lod.h"
#include "server/cli/commands.h"
#include "server/cli/describe_volume.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"

namespace intervale {
namespace {

struct InfoCommand {
  std::string file;
  std::vector<std::string> range;   // of info only
  std::optional<std::string> part;  // of info only
  RemoteOptions remote;
  bool json = false;
};

std::uint64_t size_of(const IntervalVolume& volume) { return volume.size(); }
std::uint64_t size_of(const ValueVolume& volume) { return volume.set().size(); }

// What info tells of: a ValueSummary, or this.
struct OneRange {
  std::shared_ptr<const IntervalVolume> set;
  std::uint64_t file_bytes = 0;
};
const Grid& grid_of(const ValueSummary& summary) { return summary.description.grid; }
const Grid& grid_of(const OneRange& one) { return one.set->description().grid; }
nlohmann::ordered_json stats_of(const OneRange& one) { return stats_of(*one.set, one.file_bytes); }
std::string text_of(const OneRange& one) { return text_of(*one.set, one.file_bytes); }

// Of the box of the samples, which may be oblique: in cubic world units.
double box_volume(const Grid& grid) {
  double volume = std::abs(grid.affine.determinant());
  for (const std::int32_t n : grid.dims) volume *= n - 1;
  return volume;
}

// The volume where the interpolated field lies in a range: from the table of volumes, or summed over the mesh.
Result<double> enclosed_volume(const ValueSummary& summary, const Range& range) {
  return summary.description.statistics.volumes.share_of(range) * box_volume(grid_of(summary));
}
Result<double> enclosed_volume(const OneRange& one, const Range& range) {
  const auto& set = one.set;
  const ShownRange shown = resolve(set->description(), range, {});
  if (auto held = check_held(set->description(), shown); !held) return tl::unexpected(held.error());
  const auto extracted = extract(*set, *find_relevant_updates(set, {shown}, Distances::none, on_all_cores), {}, on_all_cores);
  if (!extracted) return tl::unexpected(extracted.error());
  return volume_of(extracted->front.mesh(on_all_cores));
}

template <class DataSet>
Result<void> print_info(const InfoCommand& options, const DataSet& set) {
  const auto range = parse_range(options.range);
  if (!range) return tl::unexpected(range.error());
  const auto volume = *range ? enclosed_volume(set, **range) : Result<double>(0);
  if (!volume) return tl::unexpected(volume.error());
  const double share = *volume / box_volume(grid_of(set));
  if (options.json) {
    auto stats = stats_of(set);
    if (*range) {
      stats["enclosed_volume"] = *volume;
      stats["enclosed_share"] = share;
    }
    return print_json(stats);
  }
  std::string text = text_of(set);
  if (*range) text += fmt::format("range [{:g}, {:g}]: volume {:.6g}, {:.4g} % of the box\n", (*range)->alpha, (*range)->beta, *volume, 100 * share);
  return print(text);
}

Result<void> print_data_set(const InfoCommand& options, const std::shared_ptr<const ValueVolume>& set, std::uint64_t file_bytes) {
  return print_info(options, summary_of(*set, file_bytes));
}
Result<void> print_data_set(const InfoCommand& options, const std::shared_ptr<const IntervalVolume>& set, std::uint64_t file_bytes) {
  return print_info(options, OneRange{set, file_bytes});
}

template <class DataSet>
Result<void> verify_data_set(const InfoCommand& options, const std::shared_ptr<const DataSet>& set) {
  const std::string shown = shown_url(options.file);
  if (auto valid = validate(*set); !valid) return fail(shown + ": " + valid.error().message);
  if (options.json) return print_json({{"file", shown}, {"valid", true}, {"updates", size_of(*set)}});
  return print(printable(shown) + ": all checksums and invariants hold (" + std::to_string(size_of(*set)) + " updates)\n");
}

// Of a file: use(the data set, the file's bytes). faults: as of decode_ivm().
template <class Use>
Result<void> with_local(const std::string& file, const ParallelFor& parallel, PageFaults* faults, const Use& use) {
  const auto use_set = [&](const auto& set) { return use(set, file_size_of(file)); };
  return is_value_file(file) ? load_values(file, parallel, faults).and_then(use_set) : load_ivm(file, parallel, faults).and_then(use_set);
}

// The same, of a URL.
template <class Use>
Result<void> with_remote(const InfoCommand& options, const ParallelFor& parallel, PageFaults* faults, const Use& use) {
  const auto url = parse_remote_url(options.file);
  if (!url) return tl::unexpected(url.error());
  const auto access = read_access(options.remote);
  if (!access) return tl::unexpected(access.error());
  auto contents = read_remote(*url, *access, {}, parallel);
  if (!contents) return tl::unexpected(contents.error());
  auto& bytes = contents->bytes;
  const std::uint64_t file_bytes = bytes.size();
  const auto use_set = [&](auto set) -> Result<void> {
    bytes = {};
    if (!set) return fail(url->shown + ": " + set.error().message);
    return use(std::make_shared<const typename decltype(set)::value_type>(std::move(*set)), file_bytes);
  };
  if (scope_of(bytes) == FileScope::every_range) return use_set(decode_values(bytes, url->name, parallel, kAnyRoom, faults));
  return use_set(decode_ivm(bytes, url->name, parallel, kAnyRoom, faults));
}

template <class Use>
Result<void> with_data_set(const InfoCommand& options, const ParallelFor& parallel, PageFaults* faults, const Use& use) {
  return is_remote_url(options.file) ? with_remote(options, parallel, faults, use) : with_local(options.file, parallel, faults, use);
}

// As of load_summary().
Result<std::optional<ValueSummary>> load_any_summary(const InfoCommand& options) {
  if (!is_remote_url(options.file)) return load_summary(options.file);
  const auto url = parse_remote_url(options.file);
  if (!url) return tl::unexpected(url.error());
  const auto access = read_access(options.remote);
  if (!access) return tl::unexpected(access.error());
  return load_remote_summary(*url, *access, on_all_cores);
}

const char* name_of(Encoding encoding) {
  switch (encoding) {
    case Encoding::raw:
      return "raw";
    case Encoding::deflate:
      return "gzip";
    case Encoding::bzip2:
      return "bzip2";
    case Encoding::text:
      return "text";
    case Encoding::library:
      return "library";
  }
  return "";
}

// Of a volume that a data set can be built from. is_chosen: it is the one of several that was asked for.
Result<void> print_input(const InfoCommand& options, const VolumeHeader& header, bool is_chosen) {
  if (!options.range.empty()) return misuse("--range belongs to a data set (.ivm), and " + in_quotes(options.file) + " is an input of build");
  const auto& [dims, affine] = header.grid;
  const Vec3 spacing = affine.spacing(), origin = affine.origin();
  if (options.json) {
    auto parts = nlohmann::ordered_json::array();
    for (const VolumePart& part : header.parts) parts.push_back({{"name", part.name}, {"about", part.about}});
    return print_json({{"file", options.file},
                       {"format", header.format},
                       {"encoding", name_of(header.encoding)},
                       {"dims", dims},
                       {"type", name_of(header.type)},
                       {"components", header.components},
                       {"time_points", header.time_points},
                       {"slope", header.slope},
                       {"intercept", header.intercept},
                       {"spacing", spacing},
                       {"origin", origin},
                       {"affine", affine.rows},
                       {"space", header.labels.space},
                       {"unit", header.labels.unit},
                       {"field", header.labels.field},
                       {"field_unit", header.labels.field_unit},
                       {"parts", parts}});
  }
  std::string text = fmt::format("{}: {}{}\n", printable(options.file), header.format,
                                 header.encoding == Encoding::library ? "" : fmt::format(", {}", name_of(header.encoding)));
  if (!header.parts.empty()) {
    text += fmt::format("{} {}: choose one with build --part{}\n", header.parts.size(), header.parts_are,
                        is_chosen ? "" : "; what follows is about the first");
    for (const VolumePart& part : header.parts) text += fmt::format("  {}  {}\n", printable(part.name), printable(part.about));
  }
  text += fmt::format("samples   {} x {} x {}, {}{}\n", dims[0], dims[1], dims[2], name_of(header.type),
                      header.components == 1 ? "" : fmt::format(", {} numbers a sample", header.components));
  if (header.components > 1 && !header.component)
    text += fmt::format("numbers   {}: choose one with build --part, 0 to {}\n", header.components, header.components - 1);
  if (header.time_points > 1 && !header.time_point)
    text += fmt::format("times     {}: choose one with build --time-point, 0 to {}\n", header.time_points, header.time_points - 1);
  if (header.slope != 1 || header.intercept != 0)
    text += fmt::format("values    {:g} times the stored number, plus {:g}\n", header.slope, header.intercept);
  if (!header.labels.field.empty() || !header.labels.field_unit.empty())
    text += fmt::format("field     {}{}\n", header.labels.field, header.labels.field_unit.empty() ? "" : " in " + header.labels.field_unit);
  text += fmt::format("spacing   {:g} {:g} {:g}{}\n", spacing[0], spacing[1], spacing[2], header.labels.unit.empty() ? "" : " " + header.labels.unit);
  text += fmt::format("origin    {:g} {:g} {:g}\n", origin[0], origin[1], origin[2]);
  if (!affine.is_axis_parallel()) {
    for (std::size_t k = 0; k < 3; ++k) {
      text += fmt::format("{}{:12g} {:12g} {:12g} {:12g}\n", k == 0 ? "affine    " : "          ", affine.rows[4 * k], affine.rows[4 * k + 1],
                          affine.rows[4 * k + 2], affine.rows[4 * k + 3]);
    }
  }
  if (!header.labels.space.empty()) text += "space     " + printable(header.labels.space) + "\n";
  return print(text);
}

// A volume that build reads; true: printed. Anything else may be a data set.
Result<bool> print_if_input(const InfoCommand& options) {
  const NamedVolume volume = named_volume(options.file, options.part);
  const auto header = read_volume_header(volume.path, volume.part);
  if (!header) return tl::unexpected(header.error());
  if (*header) return print_input(options, **header, volume.part.has_value()).map([] { return true; });
  if (!begins_as_ivm(options.file) && std::filesystem::path(options.file).extension() != ".ivm")
    return fail(in_quotes(options.file) + " is neither an interval volume (.ivm) nor " + kVolumeFormats);
  return false;
}

Result<void> run_info(const InfoCommand& options) {
  if (const auto range = parse_range(options.range); !range) return tl::unexpected(range.error());
  if (is_remote_url(options.file)) {
    if (options.part) return misuse("--part belongs to a volume in a file or folder, and a URL names a data set (.ivm)");
  } else {
    const auto printed = print_if_input(options);
    if (!printed) return tl::unexpected(printed.error());
    if (*printed) return {};
  }
  const auto summary = load_any_summary(options);
  if (!summary) return tl::unexpected(summary.error());
  if (*summary) return print_info(options, **summary);
  return with_data_set(options, on_all_cores, nullptr,
                       [&](const auto& set, std::uint64_t file_bytes) { return print_data_set(options, set, file_bytes); });
}

Result<void> run_verify(const InfoCommand& options) {
  std::optional<Progress> progress("verifying " + printable(shown_url(options.file)));
  PageFaults faults;
  return with_data_set(options, with_progress(*progress, on_all_cores), &faults, [&](const auto& set, std::uint64_t) -> Result<void> {
    progress.reset();
    return faults.any() ? fail(shown_url(options.file) + ": " + to_text(faults)) : verify_data_set(options, set);
  });
}

void add_shared_options(CLI::App& command, InfoCommand& options) {
  add_remote_options(command, options.remote);
  add_remote_authorities_option(command, options.remote);
  add_json_flag(command, options.json);
}

}  // namespace

void add_info_command(Program& program) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& command = program.add_command("info", "Print dimensions, values or range, counts and sizes of a data set, or what is in a volume",
                                          [options] { return run_info(*options); });
  command.add_option("FILE", options->file, "Interval volume (.ivm), or its URL (https://, http://), or a volume or folder that build reads")
      ->required();
  command.add_option("--part,--series", options->part, "Which volume of a file or folder with several")->type_name("NAME");
  add_range_option(command, options->range, "Print the volume that this closed range of values encloses, too: numbers, -inf or inf");
  add_shared_options(command, *options);
}

void add_verify_command(Program& program) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& command =
      program.add_command("verify", "Check every checksum and every invariant of a data set", [options] { return run_verify(*options); });
  command.add_option("FILE", options->file, "Interval volume (.ivm), or its URL (https://, http://)")->required();
  add_shared_options(command, *options);
}

}  // namespace intervale
