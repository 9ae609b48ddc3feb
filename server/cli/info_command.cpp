#include <memory>

#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_verify.h"
#include "common/ivm/verify.h"
#include "common/util/printable.h"
#include "server/builder/all_cores.h"
#include "server/cli/commands.h"
#include "server/cli/describe_volume.h"

namespace intervale {
namespace {

struct InfoCommand {
  std::string file;
  bool json = false;
};

std::uint64_t size_of(const IntervalVolume& volume) { return volume.size(); }
std::uint64_t size_of(const ValueVolume& volume) { return volume.set().size(); }

// What both commands do, with a data set of one range or of every range.
struct Info {
  template <class DataSet>
  Result<void> operator()(const InfoCommand& options, const DataSet& set) const {
    if (options.json) return print_json(stats_of(set, options.file));
    return print(text_of(set, options.file));
  }
};

struct Verify {
  template <class DataSet>
  Result<void> operator()(const InfoCommand& options, const DataSet& set) const {
    if (auto valid = validate(set); !valid) return fail(options.file + ": " + valid.error().message);
    if (options.json) return print_json({{"file", options.file}, {"valid", true}, {"updates", size_of(set)}});
    return print(printable(options.file) + ": all checksums and invariants hold (" + std::to_string(size_of(set)) + " updates)\n");
  }
};

template <class Command>
void add(Program& program, const char* name, const char* description) {
  const auto options = std::make_shared<InfoCommand>();
  const auto run = [options](const auto& set) { return Command()(*options, *set); };
  CLI::App& command = program.add_command(name, description, [options, run] {
    return is_value_file(options->file) ? load_values(options->file, on_all_cores).and_then(run) : load_ivm(options->file).and_then(run);
  });
  command.add_option("FILE", options->file, "Interval volume (.ivm)")->required();
  add_json_flag(command, options->json);
}

}  // namespace

void add_info_command(Program& program) { add<Info>(program, "info", "Print dimensions, values or range, counts and sizes of a data set"); }

void add_verify_command(Program& program) { add<Verify>(program, "verify", "Check every checksum and every invariant of a data set"); }

}  // namespace intervale
