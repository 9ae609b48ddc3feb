// The options of programs that read remote files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/program/program.h"
#include "common/remote/remote_access.h"

namespace intervale {

inline constexpr const char* kRemoteGroup = "Files on web servers (https://, http://)";  // of options, in the help

struct RemoteOptions {
  std::optional<std::filesystem::path> header_file;
  bool signs = false;
  std::string aws_region;
  std::optional<std::filesystem::path> authorities;
};

// --header-file, --aws-sign and --aws-region (AWS_REGION). `options` must outlive the parsing.
void add_remote_options(CLI::App& app, RemoteOptions& options);
// --ca (INTERVALE_CA), for programs that do not have it anyway.
void add_remote_authorities_option(CLI::App& app, RemoteOptions& options);

// What they stand for: reads the file, and the keys from the environment.
[[nodiscard]] Result<RemoteAccess> read_access(const RemoteOptions& options);

}  // namespace intervale
