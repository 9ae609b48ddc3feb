// A folder of files, served over HTTP from memory: requests never read the disk. No I/O except in load().
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/util/result.h"

namespace intervale {

inline constexpr std::size_t kMaxStaticBytes = 64 << 20;  // of all files of a folder, with their compressed copies
inline constexpr std::size_t kMaxStaticFiles = 4096;

// A file's bytes, plain or compressed.
struct StaticContent {
  std::shared_ptr<const std::string> bytes;
  std::string etag;  // with quotes; XXH3 of the bytes
};

struct StaticFile {
  std::string content_type;
  bool immutable = false;  // its name contains a hash of its content
  StaticContent plain;
  std::optional<StaticContent> gzip;  // FILE.gz beside FILE
};

// Reading is safe from any thread.
class StaticFiles {
 public:
  StaticFiles() = default;  // no files

  // The regular files in a folder and its subfolders. Skipped: hidden files and folders (the name begins with a dot),
  // links that lead out of the folder, links to folders. FILE.gz beside FILE is the compressed form of FILE.
  // Failures: a folder that cannot be read or has no index.html, a file that cannot be read, more than
  // kMaxStaticBytes or kMaxStaticFiles.
  static Result<StaticFiles> load(const std::filesystem::path& folder);

  // path: from decode_path(); "/" is index.html. nullptr if there is no such file.
  [[nodiscard]] const StaticFile* find(std::string_view path) const;

 private:
  std::map<std::string, StaticFile, std::less<>> files_;  // by path in the folder, with a leading slash
};

// The path of a request target, percent-decoded, without the query. nullopt if it does not begin with a slash, has a
// % without two hexadecimal digits, or contains NUL.
[[nodiscard]] std::optional<std::string> decode_path(std::string_view target);

// Whether an Accept-Encoding header allows gzip (RFC 9110, 12.5.3). An empty one does not.
[[nodiscard]] bool accepts_gzip(std::string_view accept_encoding);

// Whether an If-None-Match header contains the tag, by weak comparison (RFC 9110, 13.1.2).
[[nodiscard]] bool matches_etag(std::string_view if_none_match, std::string_view etag);

}  // namespace intervale
