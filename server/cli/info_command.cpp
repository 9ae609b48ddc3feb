#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <type_traits>

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
  bool json = false;
};

std::uint64_t size_of(const IntervalVolume& volume) { return volume.size(); }
std::uint64_t size_of(const ValueVolume& volume) { return volume.set().size(); }

// Of the box of the samples, which may be oblique: in cubic world units.
double box_volume(const Grid& grid) {
  double volume = std::abs(grid.affine.determinant());
  for (const std::int32_t n : grid.dims) volume *= n - 1;
  return volume;
}

// The volume where the interpolated field lies in a range: from the table of volumes, or summed over the mesh.
Result<double> enclosed_volume(const std::shared_ptr<const ValueVolume>& set, const Range& range) {
  return set->description().statistics.volumes.share_of(range) * box_volume(set->description().grid);
}
Result<double> enclosed_volume(const std::shared_ptr<const IntervalVolume>& set, const Range& range) {
  const ShownRange shown = resolve(set->description(), range, {});
  if (auto held = check_held(set->description(), shown); !held) return tl::unexpected(held.error());
  const auto extracted = extract(*set, *find_relevant_updates(set, {shown}, Distances::none, on_all_cores), {}, on_all_cores);
  if (!extracted) return tl::unexpected(extracted.error());
  return volume_of(extracted->front.mesh(on_all_cores));
}

// What both commands do, with a data set of one range or of every range.
struct Info {
  template <class DataSet>
  Result<void> operator()(const InfoCommand& options, const std::shared_ptr<const DataSet>& set) const {
    const auto range = parse_range(options.range);
    if (!range) return tl::unexpected(range.error());
    const auto volume = *range ? enclosed_volume(set, **range) : Result<double>(0);
    if (!volume) return tl::unexpected(volume.error());
    const double share = *volume / box_volume(set->description().grid);
    if (options.json) {
      auto stats = stats_of(*set, options.file);
      if (*range) {
        stats["enclosed_volume"] = *volume;
        stats["enclosed_share"] = share;
      }
      return print_json(stats);
    }
    std::string text = text_of(*set, options.file);
    if (*range)
      text += fmt::format("range [{:g}, {:g}]: volume {:.6g}, {:.4g} % of the box\n", (*range)->alpha, (*range)->beta, *volume, 100 * share);
    return print(text);
  }
};

// The data set of a file. faults: as of decode_ivm().
template <class Use>
Result<void> with_data_set(const std::string& file, const ParallelFor& parallel, PageFaults* faults, const Use& use) {
  return is_value_file(file) ? load_values(file, parallel, faults).and_then(use) : load_ivm(file, parallel, faults).and_then(use);
}

struct Verify {
  template <class DataSet>
  Result<void> operator()(const InfoCommand& options, const std::shared_ptr<const DataSet>& set) const {
    if (auto valid = validate(*set); !valid) return fail(options.file + ": " + valid.error().message);
    if (options.json) return print_json({{"file", options.file}, {"valid", true}, {"updates", size_of(*set)}});
    return print(printable(options.file) + ": all checksums and invariants hold (" + std::to_string(size_of(*set)) + " updates)\n");
  }
};

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

template <class Command>
void add(Program& program, const char* name, const char* description) {
  const auto options = std::make_shared<InfoCommand>();
  const auto run = [options](const auto& set) { return Command()(*options, set); };
  CLI::App& command = program.add_command(name, description, [options, run]() -> Result<void> {
    if constexpr (std::is_same_v<Command, Info>) {
      const NamedVolume volume = named_volume(options->file, options->part);
      const auto header = read_volume_header(volume.path, volume.part);
      if (header && *header) return print_input(*options, **header, volume.part.has_value());
      if (!header) return tl::unexpected(header.error());
      if (!begins_as_ivm(options->file) && std::filesystem::path(options->file).extension() != ".ivm")
        return fail(in_quotes(options->file) + " is neither an interval volume (.ivm) nor " + kVolumeFormats);
    }
    if constexpr (std::is_same_v<Command, Verify>) {
      std::optional<Progress> progress("verifying " + printable(options->file));
      PageFaults faults;
      return with_data_set(options->file, with_progress(*progress, on_all_cores), &faults, [&](const auto& set) -> Result<void> {
        progress.reset();
        return faults.any() ? fail(options->file + ": " + to_text(faults)) : run(set);
      });
    }
    return with_data_set(options->file, on_all_cores, nullptr, run);
  });
  constexpr bool is_info = std::is_same_v<Command, Info>;
  command.add_option("FILE", options->file, is_info ? "Interval volume (.ivm), or a volume or folder that build reads" : "Interval volume (.ivm)")
      ->required();
  if constexpr (is_info) {
    command.add_option("--part,--series", options->part, "Which volume of a file or folder with several")->type_name("NAME");
    add_range_option(command, options->range, "Print the volume that this closed range of values encloses, too: numbers, -inf or inf");
  }
  add_json_flag(command, options->json);
}

}  // namespace

void add_info_command(Program& program) {
  add<Info>(program, "info", "Print dimensions, values or range, counts and sizes of a data set, or what is in a volume");
}

void add_verify_command(Program& program) { add<Verify>(program, "verify", "Check every checksum and every invariant of a data set"); }

}  // namespace intervale
