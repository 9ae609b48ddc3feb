// A command-line program: subcommands, one-line errors, exit statuses, results as text or JSON.
//
//   int main(int argc, char** argv) {
//     intervale::Program program("intervale", "Build, inspect and serve interval volumes");
//     auto options = std::make_shared<InfoOptions>();
//     CLI::App& info = program.add_command("info", "Print what a file contains", [options] { return info(*options); });
//     info.add_option("file", options->file, "An .ivm file")->required();
//     add_json_flag(info, options->json);
//     return program.run(argc, argv);
//   }
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/util/result.h"

namespace intervale {

enum ExitStatus : int { kExitDone = 0, kExitFailed = 1, kExitUsage = 2 };

// Has --help, --version and --config. Every option with a long name is also read from the environment (--max-tets:
// INTERVALE_MAX_TETS; several values as 1,2,3) and from the --config file (TOML or INI, a section for each command).
// The command line takes precedence over the file, and the file over the environment. One thread.
class Program {
 public:
  Program(std::string name, std::string description);

  // Adds a subcommand, of which the user gives exactly one. Add options to the result, which lives as long as the
  // program. The body runs after the options are parsed; what it captures must live until run() returns.
  CLI::App& add_command(const std::string& name, const std::string& description, std::function<Result<void>()> body);

  // For a program without subcommands, in place of add_command().
  CLI::App& only_command(std::function<Result<void>()> body);

  // Parses the arguments, runs the command, and returns main's exit status. An error or an exception becomes one line
  // on stderr, "<name>: <message>", and status 1, or 2 for wrong usage (parser errors, and Error::usage). Call once.
  int run(int argc, const char* const* argv);

 private:
  int report(const std::string& message, ExitStatus status) const;

  std::string name_;
  CLI::App app_;
  std::vector<std::pair<CLI::App*, std::function<Result<void>()>>> commands_;
};

// --json: one JSON object on stdout, and nothing else.
CLI::Option* add_json_flag(CLI::App& app, bool& json);
// --digest: the results include mesh_digest().
CLI::Option* add_digest_flag(CLI::App& app, bool& digest);

// Print to stdout and flush; a full disk or a closed pipe is a failure. Text is printed unchanged; an object on one
// line, with U+FFFD for bytes that are not UTF-8.
Result<void> print(const std::string& text);
Result<void> print_json(const nlohmann::ordered_json& object);

// A number of bytes for people, in powers of 1000: "512 B", "1.5 kB", "21.0 MB".
[[nodiscard]] std::string human_bytes(std::uint64_t bytes);

}  // namespace intervale
