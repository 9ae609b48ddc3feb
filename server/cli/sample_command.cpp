#include <fmt/core.h>
#include <fmt/ranges.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "server/cli/commands.h"
#include "server/volume/nrrd.h"
#include "server/volume/samples.h"

namespace intervale {
namespace {

struct SampleCommand {
  std::string name;
  std::string output;
  int size = 129;
  bool json = false;
};

Result<void> run(const SampleCommand& options) {
  const auto volume = make_sample(options.name, options.size);
  if (!volume) return tl::unexpected(volume.error());
  if (auto written = write_nrrd(options.output, *volume); !written) return written;
  if (options.json)
    return print_json({{"name", options.name}, {"dims", volume->grid.dims}, {"file", options.output}, {"bytes", volume->bytes.size()}});
  return print(fmt::format("wrote {}: {} at {} samples a side, {}\n", options.output, options.name, options.size, human_bytes(volume->bytes.size())));
}

}  // namespace

void add_sample_command(Program& program) {
  const auto options = std::make_shared<SampleCommand>();
  CLI::App& command = program.add_command("sample", "Write a synthetic volume, for tests and demonstrations", [options] { return run(*options); });
  command.add_option("NAME", options->name, fmt::format("{}", fmt::join(sample_names(), ", ")))->required();
  command.add_option("-o,--output", options->output, "Volume to write (.nrrd)")->required()->type_name("FILE");
  command.add_option("--size", options->size, "Number of samples along each axis")->capture_default_str();
  add_json_flag(command, options->json);
}

}  // namespace intervale
