// Whether a file is still the one it was.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>

namespace intervale {

struct FileStamp {
  std::int64_t seconds = 0, nanoseconds = 0;  // when it was last written
  std::uint64_t bytes = 0, device = 0, inode = 0;
  friend bool operator==(const FileStamp&, const FileStamp&) = default;
};

// Nothing if there is no such file. Follows links, as those of a mounted secret, which change all at once.
[[nodiscard]] inline std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {};
  return FileStamp{status.st_mtim.tv_sec, status.st_mtim.tv_nsec, std::uint64_t(status.st_size), std::uint64_t(status.st_dev),
                   std::uint64_t(status.st_ino)};
}

}  // namespace intervale
