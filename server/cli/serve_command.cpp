#include <memory>

#include "server/cli/commands.h"
#include "server/serve/serve.h"

namespace intervale {
namespace {

struct ServeCommand {
  ServeOptions serve;
  std::vector<std::string> inputs;
};

Result<void> run(const ServeCommand& options) {
  return serve(options.serve, std::vector<std::filesystem::path>(options.inputs.begin(), options.inputs.end()));
}

}  // namespace

void add_serve_command(Program& program) {
  const auto options = std::make_shared<ServeCommand>();
  CLI::App& command =
      program.add_command("serve", "Streams interval volumes to clients, until SIGTERM or Ctrl-C", [options] { return run(*options); });
  command.add_option("INPUTS", options->inputs, "Interval volumes (.ivm), or folders of them")->required()->type_name("FILE.ivm|FOLDER ...");
  command.add_option("--listen", options->serve.listen, "Address and port; [::1]:8080 for IPv6, port 0 for any free one")->capture_default_str();
  command
      .add_option_function<std::string>(
          "--viewer", [options](const std::string& folder) { options->serve.viewer = folder; },
          "Where the browser's viewer is; by default ../share/intervale/viewer from this program's folder, if that is there")
      ->type_name("FOLDER");
  command.add_option("--threads", options->serve.threads, "0: one for each core")->capture_default_str();
  command.add_option("--max-connections", options->serve.max_connections, "More than these are turned away")->capture_default_str();
}

}  // namespace intervale
