// The programs under test, and a data set made with them.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace intervale {

// Debian's, which has Debian's packages.
inline constexpr const char* kPython = "/usr/bin/python3";

using Arguments = std::vector<std::string>;
inline Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// A program's path: in $INTERVALE_BIN, else where this build puts its programs.
[[nodiscard]] std::string program(const std::string& name);

// The buckyball, 65 samples a side, [128, 188]; made once a run: "…/buckyball.ivm".
[[nodiscard]] const std::filesystem::path& buckyball();

// `intervale serve` on a free port, ready; more: options. environment: NAME=VALUE.
class ServerProgram {
 public:
  explicit ServerProgram(const std::string& input = buckyball().string(), const std::vector<std::string>& more = {},
                         const std::vector<std::string>& environment = {});
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] std::string url(const std::string& name = {}) const;
  [[nodiscard]] Process& process() { return process_; }

 private:
  Process process_;
  std::uint16_t port_ = 0;
};

}  // namespace intervale
