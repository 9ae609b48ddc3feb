#include <memory>

#include "common/ivm/ivm_file.h"
#include "common/ivm/verify.h"
#include "common/util/printable.h"
#include "server/cli/commands.h"
#include "server/cli/describe_volume.h"

namespace intervale {
namespace {

struct InfoCommand {
  std::string file;
  bool json = false;
};

Result<void> info(const InfoCommand& options, const IntervalVolume& volume) {
  if (options.json) return print_json(stats_of(volume, options.file));
  return print(text_of(volume, options.file));
}

Result<void> verify(const InfoCommand& options, const IntervalVolume& volume) {
  if (auto valid = validate(volume); !valid) return fail(options.file + ": " + valid.error().message);
  if (options.json) return print_json({{"file", options.file}, {"valid", true}, {"updates", volume.size()}});
  return print(printable(options.file) + ": all checksums and invariants hold (" + std::to_string(volume.size()) + " updates)\n");
}

void add(Program& program, const char* name, const char* description, Result<void> (*run)(const InfoCommand&, const IntervalVolume&)) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& command = program.add_command(
      name, description, [options, run] { return load_ivm(options->file).and_then([&](const auto& volume) { return run(*options, *volume); }); });
  command.add_option("FILE", options->file, "Interval volume (.ivm)")->required();
  add_json_flag(command, options->json);
}

}  // namespace

void add_info_command(Program& program) { add(program, "info", "Print dimensions, range, counts and sizes of an interval volume", info); }

void add_verify_command(Program& program) { add(program, "verify", "Check every checksum and every invariant of an interval volume", verify); }

}  // namespace intervale
