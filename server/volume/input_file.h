// A file of samples, read by position.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "common/patch/volume.h"
#include "common/util/result.h"

namespace intervale {

// An open regular file. Reading by position has no state, so several threads may read one file.
class InputFile {
 public:
  static Result<InputFile> open(const std::filesystem::path& path);  // fails on folders, pipes and devices, which have no size
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;
  ~InputFile();

  [[nodiscard]] std::uint64_t size() const { return size_; }  // bytes, when it was opened
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  // Up to out.size() bytes from `offset` on; fewer only at the end of the file.
  [[nodiscard]] Result<std::size_t> read_some(std::uint64_t offset, std::span<std::byte> out) const;
  // Exactly out.size() bytes; an error if the file ends before.
  [[nodiscard]] Result<void> read(std::uint64_t offset, std::span<std::byte> out) const;

 private:
  InputFile(std::filesystem::path path, int descriptor, std::uint64_t size);
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

// A path as error messages show it, between apostrophes.
[[nodiscard]] std::string in_quotes(const std::filesystem::path& path);

// The grid of a volume, if check_grid (description.h) accepts it. The message begins with `where`.
Result<Grid> make_grid(const std::array<std::int64_t, 3>& dims, const Affine& affine, const std::string& where);

// Reverses the bytes of every sample, in place.
void swap_bytes(std::span<std::byte> samples, SampleType type);

}  // namespace intervale
