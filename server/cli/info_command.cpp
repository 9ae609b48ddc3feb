#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <type_traits>

#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_verify.h"
#include "common/ivm/verify.h"
#include "common/mesh/mesh.h"
#include "common/program/range_option.h"
#include "common/util/printable.h"
#include "common/view/lod.h"
#include "server/builder/all_cores.h"
#include "server/builder/find_relevant_updates.h"
#include "server/cli/commands.h"
#include "server/cli/describe_volume.h"

namespace intervale {
namespace {

struct InfoCommand {
  std::string file;
  std::vector<std::string> range;  // of info only
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
  const auto extracted = extract(*set, *find_relevant_updates(set, {shown}, Distances::none), {}, on_all_cores);
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

struct Verify {
  template <class DataSet>
  Result<void> operator()(const InfoCommand& options, const std::shared_ptr<const DataSet>& set) const {
    if (auto valid = validate(*set); !valid) return fail(options.file + ": " + valid.error().message);
    if (options.json) return print_json({{"file", options.file}, {"valid", true}, {"updates", size_of(*set)}});
    return print(printable(options.file) + ": all checksums and invariants hold (" + std::to_string(size_of(*set)) + " updates)\n");
  }
};

template <class Command>
void add(Program& program, const char* name, const char* description) {
  const auto options = std::make_shared<InfoCommand>();
  const auto run = [options](const auto& set) { return Command()(*options, set); };
  CLI::App& command = program.add_command(name, description, [options, run] {
    return is_value_file(options->file) ? load_values(options->file, on_all_cores).and_then(run) : load_ivm(options->file).and_then(run);
  });
  command.add_option("FILE", options->file, "Interval volume (.ivm)")->required();
  if constexpr (std::is_same_v<Command, Info>) {
    add_range_option(command, options->range, "Print the volume that this closed range of values encloses, too: numbers, -inf or inf");
  }
  add_json_flag(command, options->json);
}

}  // namespace

void add_info_command(Program& program) { add<Info>(program, "info", "Print dimensions, values or range, counts and sizes of a data set"); }

void add_verify_command(Program& program) { add<Verify>(program, "verify", "Check every checksum and every invariant of a data set"); }

}  // namespace intervale
