#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/cli/commands.h"
#include "server/serve/serve.h"

namespace intervale {
namespace {

struct ServeCommand {
  ServeOptions serve;
  LogOptions log;
  std::vector<std::string> inputs;
};

Result<void> run(const ServeCommand& options) {
  return serve(options.serve, options.log, std::vector<std::filesystem::path>(options.inputs.begin(), options.inputs.end()));
}

// What a configuration file says of the log level; nothing if it says nothing, or cannot be read.
std::optional<std::string> configured_level(const std::string& file) {
  try {
    for (const CLI::ConfigItem& item : CLI::ConfigTOML().from_file(file)) {
      if (item.parents == std::vector<std::string>{"serve"} && item.name == "log-level" && item.inputs.size() == 1) return item.inputs.front();
    }
  } catch (const CLI::Error& error) {
    spdlog::warn("cannot read {} again: {}", file, error.what());
  }
  return {};
}

void add_log_options(CLI::App& command, LogOptions& log) {
  const auto group = "Observation";
  command
      .add_option_function<std::string>(
          "--log-format", [&log](const std::string& format) { log.format = format == "json" ? LogFormat::json : LogFormat::text; },
          "Lines of text (default) or JSON, on stderr")
      ->check([](const std::string& format) { return std::string(format == "text" || format == "json" ? "" : "must be text or json"); })
      ->type_name("text|json")
      ->group(group);
  command.add_option("--log-level", log.level, "SIGHUP: what the --config file says now; if it says nothing, debug and back")
      ->check([](const std::string& level) { return std::string(is_log_level(level) ? "" : "must be trace, debug, info, warn, error or off"); })
      ->type_name("LEVEL")
      ->capture_default_str()
      ->group(group);
  log.configured_level = [&command]() -> std::optional<std::string> {
    const CLI::Option* const config = command.get_parent()->get_config_ptr();
    if (config == nullptr || config->count() == 0) return {};
    return configured_level(config->as<std::string>());
  };
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
  command
      .add_option_function<std::string>(
          "--metrics-listen", [options](const std::string& address) { options->serve.metrics_listen = address; },
          "Address and port where /metrics is answered instead, to plain HTTP and everybody: keep it to those who watch")
      ->type_name("ADDRESS:PORT")
      ->group("Observation");
  add_log_options(command, options->log);
  command.add_option("--max-connections", options->serve.max_connections, "More than these are turned away")->capture_default_str();
}

}  // namespace intervale
