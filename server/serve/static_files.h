// A folder of files as they are answered over HTTP. It is read once, into memory: no request ever touches the disk. No I/O but in load().
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

inline constexpr std::size_t kMaxStaticBytes = 64 << 20;  // of all files of a folder, packed ones too
inline constexpr std::size_t kMaxStaticFiles = 4096;

// One way a file can be sent.
struct StaticContent {
  std::shared_ptr<const std::string> bytes;
  std::string etag;  // with its quotes; XXH3 of the bytes
};

struct StaticFile {
  std::string content_type;
  bool immutable = false;  // its name changes whenever its content does
  StaticContent plain;
  std::optional<StaticContent> gzip;  // FILE.gz beside FILE
};

// Reading is safe from any thread.
class StaticFiles {
 public:
  StaticFiles() = default;  // no files

  // The regular files in a folder and below. Left out: what is hidden (a name on its path begins with a dot), links to what lies outside the folder,
  // folders that are links. FILE.gz beside FILE is no file of its own but FILE, packed. Failures: a folder that cannot be read or has no index.html,
  // a file that cannot be read, more than kMaxStaticBytes or kMaxStaticFiles.
  static Result<StaticFiles> load(const std::filesystem::path& folder);

  // By a path as decode_path gives it; "/" is index.html. nullptr if there is none.
  [[nodiscard]] const StaticFile* find(std::string_view path) const;
  [[nodiscard]] bool empty() const { return files_.empty(); }

 private:
  std::map<std::string, StaticFile, std::less<>> files_;  // by path from the folder on, with a slash first
};

// A request target's path with its %XX resolved, without the query. Nothing if it does not begin with a slash, a % is not followed by two hexadecimal
// digits, or there is a NUL.
[[nodiscard]] std::optional<std::string> decode_path(std::string_view target);

// Whether an Accept-Encoding header allows gzip (RFC 9110, 12.5.3). An empty one does not.
[[nodiscard]] bool accepts_gzip(std::string_view accept_encoding);

// Whether an If-None-Match header names the tag, weakly compared (RFC 9110, 13.1.2).
[[nodiscard]] bool matches_etag(std::string_view if_none_match, std::string_view etag);

}  // namespace intervale
