#include "common/program/program.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>

#include "common/util/printable.h"

namespace intervale {
namespace {

// The parser's messages may contain line breaks; our errors are one line.
std::string one_line(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string environment_name(const std::string& long_name) {
  std::string name = "INTERVALE_" + long_name;
  for (char& c : name) c = c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

void set_environment_names(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const auto& names = option->get_lnames();
    if (names.empty() || names.front() == "help" || names.front() == "version" || !option->get_envname().empty()) continue;
    option->envname(environment_name(names.front()));
    if (option->get_items_expected_max() > 1) option->delimiter(',');  // a variable is one string
  }
}

}  // namespace

Program::Program(std::string name, std::string description) : name_(std::move(name)), app_(std::move(description), name_) {
  app_.require_subcommand(1);
  app_.set_version_flag("--version", name_ + " " INTERVALE_VERSION);
  app_.set_config("--config", "", "Read options from a TOML or INI file, with a section for each command");
  app_.allow_config_extras(CLI::config_extras_mode::error);
}

CLI::App& Program::add_command(const std::string& name, const std::string& description, std::function<Result<void>()> body) {
  CLI::App& command = *app_.add_subcommand(name, description);
  command.fallthrough();  // --config is also accepted after the command
  commands_.emplace_back(&command, std::move(body));
  return command;
}

CLI::App& Program::only_command(std::function<Result<void>()> body) {
  app_.require_subcommand(0);
  commands_.emplace_back(&app_, std::move(body));
  return app_;
}

int Program::run(int argc, const char* const* argv) {
  // A closed pipe and the limit of a file's size are errors to report: the signals would leave half a file behind.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  set_environment_names(app_);
  for (auto& [command, body] : commands_) set_environment_names(*command);
  try {
    app_.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version: not errors
    return app_.exit(asked);
  } catch (const CLI::Error& error) {
    const auto begun = app_.get_subcommands();
    const std::string of = begun.empty() ? "" : begun.front()->get_name() + " ";
    const bool is_unknown = begun.empty() && argc > 1 && argv[1][0] != '-' && !app_.get_subcommands([](const CLI::App*) { return true; }).empty();
    const std::string what = is_unknown ? "unknown command '" + std::string(argv[1]) + "'" : one_line(error.what());
    return report(what + " (see " + name_ + " " + of + "--help)", kExitUsage);
  }
  try {
    for (auto& [command, body] : commands_) {
      if (!command->parsed()) continue;
      if (auto result = body(); !result) return report(result.error().message, result.error().usage ? kExitUsage : kExitFailed);
    }
  } catch (const std::bad_alloc&) {
    return report("out of memory", kExitFailed);
  } catch (const std::exception& exception) {
    return report(exception.what(), kExitFailed);
  }
  return kExitDone;
}

int Program::report(const std::string& message, ExitStatus status) const {
  const std::string line = name_ + ": " + printable(one_line(message)) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
  return status;
}

CLI::Option* add_json_flag(CLI::App& app, bool& json) { return app.add_flag("--json", json, "Print the results as one JSON object"); }
CLI::Option* add_digest_flag(CLI::App& app, bool& digest) {
  return app.add_flag("--digest", digest, "Print a digest of the mesh: equal for equal meshes, whatever the order of vertices and tetrahedra");
}

Result<void> print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0) return {};
  return fail(std::string("cannot write to the standard output: ") + std::strerror(errno));
}

Result<void> print_json(const nlohmann::ordered_json& object) {
  return print(object.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

std::string human_bytes(std::uint64_t bytes) {
  if (bytes < 1000) return fmt::format("{} B", bytes);
  constexpr std::array<const char*, 4> kUnits{"kB", "MB", "GB", "TB"};
  double value = static_cast<double>(bytes) / 1000;
  std::size_t unit = 0;
  while (value >= 999.95 && unit + 1 < kUnits.size()) {  // 999.95 would be rounded to 1000.0
    value /= 1000;
    ++unit;
  }
  return fmt::format("{:.1f} {}", value, kUnits[unit]);
}

}  // namespace intervale
