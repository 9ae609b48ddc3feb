// A command-line program of ours: subcommands, one-line errors, exit statuses, figures as text or JSON.
//
//   int main(int argc, char** argv) {
//     intervale::Program program("intervale", "Makes, inspects and serves interval volumes");
//     auto options = std::make_shared<InfoOptions>();
//     CLI::App& info = program.add_command("info", "Says what is in a file", [options] { return info(*options); });
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

// Has --help, --version and --config of its own accord. Every option with a long name also comes from the environment (--max-tets:
// INTERVALE_MAX_TETS; several values as 1,2,3) and from the --config file (TOML or INI, a section for each command); the command line wins
// over the file, and the file over the environment. One thread.
class Program {
 public:
  Program(std::string name, std::string description);

  // A subcommand; exactly one is given. Add options to what comes back, which lives as long as this. The body runs once the options are
  // read; what it captures must live until run() returns.
  CLI::App& add_command(const std::string& name, const std::string& description, std::function<Result<void>()> body);

  // Instead, for a program that does one thing only: its options stand without a subcommand.
  CLI::App& only_command(std::function<Result<void>()> body);

  // Reads the arguments, runs the command, and returns what main returns. An error, an exception too, becomes one line on stderr,
  // "<name>: <message>", and status 1, or 2 for wrong usage (what the parser refuses, and Error::usage). Call once.
  int run(int argc, const char* const* argv);

 private:
  int complain(const std::string& message, ExitStatus status) const;

  std::string name_;
  CLI::App app_;
  std::vector<std::pair<CLI::App*, std::function<Result<void>()>>> commands_;
};

// --json: one JSON object on stdout and nothing else there.
CLI::Option* add_json_flag(CLI::App& app, bool& json);
// --digest: what mesh_digest says of the mesh is among the figures.
CLI::Option* add_digest_flag(CLI::App& app, bool& digest);

// Prints to stdout and sees that it arrived (a full disk or a closed pipe is a failure): text as it stands; an object on one line, and what is no
// UTF-8 in it as U+FFFD.
Result<void> print(const std::string& text);
Result<void> print_json(const nlohmann::ordered_json& object);

// A count of bytes for people: "512 B", "1.5 kB", "21.0 MB". Decimal.
[[nodiscard]] std::string human_bytes(std::uint64_t bytes);

}  // namespace intervale
