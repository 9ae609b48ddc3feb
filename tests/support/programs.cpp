#include "tests/support/programs.h"

#include <cstdlib>
#include <stdexcept>

#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

void must(const Finished& finished) {
  if (finished.status != 0) throw std::runtime_error("a data set could not be made: " + finished.err);
}

std::vector<std::string> command(const std::string& input, const std::vector<std::string>& more, const std::vector<std::string>& environment) {
  std::vector<std::string> arguments{"/usr/bin/env"};
  arguments.insert(arguments.end(), environment.begin(), environment.end());
  arguments.insert(arguments.end(), {program("intervale"), "serve", input, "--listen", "127.0.0.1:0"});
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace

std::string program(const std::string& name) {
  const char* const folder = std::getenv("INTERVALE_BIN");
  return std::string(folder != nullptr ? folder : INTERVALE_BIN) + "/" + name;
}

const std::filesystem::path& buckyball() {
  static const TempDir folder;
  static const std::filesystem::path path = [] {
    const std::string volume = folder / "buckyball.nrrd";
    const std::string made = folder / "buckyball.ivm";
    must(run({program("intervale"), "sample", "buckyball", "--size", "65", "-o", volume}));
    must(run({program("intervale"), "build", volume, "-o", made, "--range", "128", "188"}));
    return std::filesystem::path(made);
  }();
  return path;
}

ServerProgram::ServerProgram(const std::string& input, const std::vector<std::string>& more, const std::vector<std::string>& environment)
    : process_(command(input, more, environment)) {
  const std::string before = "://127.0.0.1:";
  const auto said = process_.wait_for("/\n");
  if (!said || said->find(before) == std::string::npos) throw std::runtime_error("the server did not start: " + said.value_or(process_.wait().err));
  port_ = static_cast<std::uint16_t>(std::stoi(said->substr(said->find(before) + before.size())));
}

std::string ServerProgram::url(const std::string& name) const { return "ws://127.0.0.1:" + std::to_string(port_) + (name.empty() ? "" : "/" + name); }

}  // namespace intervale
