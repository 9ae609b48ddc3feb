// Who asks for a remote file: credentials, which only the origin that the user named gets, and what is trusted.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/util/result.h"

namespace intervale {

// Signs requests for S3 (AWS Signature Version 4).
struct AwsSigning {
  std::string region;
  std::string key_id, secret;
  std::string session_token;  // empty: none
};

// Secrets: never part of an error, a log or another origin's requests.
struct RemoteAccess {
  std::vector<std::string> headers;  // "Name: value", as read_header_file() makes them
  std::optional<AwsSigning> aws;
  std::optional<std::filesystem::path> authorities;  // PEM file of certificates to trust instead of the system's
};

// A file of headers: on each line "Name: value"; empty lines and lines that begin with # are skipped. At most 64 KiB.
// Headers that this library sets itself (Host, Range, conditions and what describes a body) are refused. Errors name the
// file and the line, and show no value.
[[nodiscard]] Result<std::vector<std::string>> read_header_file(const std::filesystem::path& path);

// From AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN. Misuse if one of the first two is missing.
[[nodiscard]] Result<AwsSigning> aws_from_environment(std::string region);

}  // namespace intervale
