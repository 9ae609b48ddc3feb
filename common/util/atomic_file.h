// Writing a file so that nobody ever sees half of it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "common/util/result.h"

namespace intervale {

// A file being written beside its final place. commit() syncs and renames; destruction without commit removes what was written.
class AtomicFile {
 public:
  static Result<AtomicFile> create(const std::filesystem::path& path);
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  Result<void> write(
      std::span<const std::byte> bytes);  // appends; buffered; an error names the path and the system's reason ("No space left on device")
  Result<void> commit();

 private:
  AtomicFile(std::filesystem::path path, std::filesystem::path beside, int descriptor);
  Result<void> flush();
  std::filesystem::path path_, beside_;
  int descriptor_ = -1;
  std::vector<std::byte> buffer_;
};

}  // namespace intervale
