// Writes files atomically: readers see the old file or the complete new one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "common/util/result.h"

namespace intervale {

// A temporary file beside the final path. commit() syncs and renames it; destruction without commit() removes it.
class AtomicFile {
 public:
  static Result<AtomicFile> create(const std::filesystem::path& path);
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  // Appends, with a buffer of 1 MiB. Errors name the path and the system's reason ("No space left on device").
  Result<void> write(std::span<const std::byte> bytes);
  Result<void> commit();
  // Where it is until then; others may write there, too, in places of their own. Empty: the output is no regular file.
  [[nodiscard]] const std::filesystem::path& temporary() const { return beside_; }

 private:
  AtomicFile(std::filesystem::path path, std::filesystem::path beside, int descriptor);
  Result<void> flush();
  std::filesystem::path path_, beside_;
  int descriptor_ = -1;
  std::vector<std::byte> buffer_;
};

}  // namespace intervale
