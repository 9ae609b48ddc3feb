// The pages of a TIFF file, or of the files in a folder, by libtiff.
#pragma once

#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/util/result.h"
#include "server/volume/input_file.h"

namespace intervale {

class TiffFile {
 public:
  explicit TiffFile(const std::filesystem::path& path);
  [[nodiscard]] bool is_open() const { return tiff_ != nullptr; }
  [[nodiscard]] TIFF* get() const { return tiff_.get(); }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const;  // bytes
  // With the first thing that libtiff complained about.
  [[nodiscard]] tl::unexpected<Error> failure(const std::string& what) const;

 private:
  std::filesystem::path path_;
  std::string message_;
  std::unique_ptr<TIFF, void (*)(TIFF*)> tiff_{nullptr, TIFFClose};
};

// What must be the same on all pages.
struct Page {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0, format = SAMPLEFORMAT_UINT, samples = 1;
  bool is_palette = false;
  friend bool operator==(const Page&, const Page&) = default;
};

// Where a file has a page.
struct Directory {
  toff_t offset = 0;
  std::uint64_t number = 0;  // among all, smaller copies and masks counted
};

// The pages of a file or of a folder's files, one after the other, but for smaller copies of pages and masks.
class Pages {
 public:
  // At the first page. One page at least.
  static Result<Pages> of(const std::filesystem::path& path);

  [[nodiscard]] std::size_t size() const { return files_.size() > 1 ? files_.size() : images_ ? images_->count : directories_.size(); }
  [[nodiscard]] bool is_one_file() const { return files_.size() == 1; }
  [[nodiscard]] const TiffFile& file() const { return *file_; }  // at the page last gone to
  [[nodiscard]] Page page() const;                               // that it is at
  // Of a file with one page: takes what follows its samples as more pages of the same kind, of which the file says nothing.
  // So ImageJ writes stacks above 4 GiB. Fails if they are not there, or if its samples are not plain and in one run.
  Result<void> go_on_for(std::uint64_t count);
  // The page of a directory, smaller copies and masks counted; none if it is one of these. Only of a single file.
  [[nodiscard]] std::optional<std::size_t> of_directory(std::uint64_t number) const;
  // The samples of a page, row by row. width: bytes of a sample. Fails unless the page is like `first`.
  Result<void> read(std::size_t number, const Page& first, std::size_t width, std::vector<std::byte>& out);

 private:
  // Plain samples, one page after the other.
  struct Images {
    InputFile file;
    std::uint64_t offset, bytes;  // of the first; of one
    std::uint64_t count;
  };
  Result<void> read_image(std::size_t number, std::size_t width, std::vector<std::byte>& out) const;
  Result<void> go_to(std::size_t page);
  Result<void> open(std::size_t number);
  std::vector<std::filesystem::path> files_;
  std::vector<Directory> directories_;  // of pages, in a single file
  std::optional<Images> images_;
  std::unique_ptr<TiffFile> file_;
};

}  // namespace intervale
