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

Result<void> info(const InfoCommand& options) {
  const auto volume = load_ivm(options.file);
  if (!volume) return tl::unexpected(volume.error());
  if (options.json) return print_json(stats_of(**volume, options.file));
  return print(text_of(**volume, options.file));
}

Result<void> verify(const InfoCommand& options) {
  const auto volume = load_ivm(options.file);
  if (!volume) return tl::unexpected(volume.error());
  if (auto valid = validate(**volume); !valid) return fail(options.file + ": " + valid.error().message);
  if (options.json) return print_json({{"file", options.file}, {"valid", true}, {"updates", (*volume)->size()}});
  return print(printable(options.file) + ": all checksums and invariants hold (" + std::to_string((*volume)->size()) + " updates)\n");
}

}  // namespace

void add_info_command(Program& program) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& command =
      program.add_command("info", "Print dimensions, range, counts and sizes of an interval volume", [options] { return info(*options); });
  command.add_option("FILE", options->file, "Interval volume (.ivm)")->required();
  add_json_flag(command, options->json);
}

void add_verify_command(Program& program) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& command =
      program.add_command("verify", "Check every checksum and every invariant of an interval volume", [options] { return verify(*options); });
  command.add_option("FILE", options->file, "Interval volume (.ivm)")->required();
  add_json_flag(command, options->json);
}

}  // namespace intervale
