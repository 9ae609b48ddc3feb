// Detects that a file has changed.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>

namespace intervale {

struct FileStamp {
  std::int64_t seconds = 0, nanoseconds = 0;                  // last modification
  std::int64_t changed_seconds = 0, changed_nanoseconds = 0;  // last status change (ctime), which programs cannot set
  std::uint64_t bytes = 0, device = 0, inode = 0;
  friend bool operator==(const FileStamp&, const FileStamp&) = default;
};

// nullopt if there is no such file. Follows links: a mounted Kubernetes secret is replaced by changing a link.
[[nodiscard]] inline std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {};
  return FileStamp{status.st_mtim.tv_sec,         status.st_mtim.tv_nsec,       status.st_ctim.tv_sec,       status.st_ctim.tv_nsec,
                   std::uint64_t(status.st_size), std::uint64_t(status.st_dev), std::uint64_t(status.st_ino)};
}

}  // namespace intervale
