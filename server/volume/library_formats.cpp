#include "server/volume/library_formats.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "server/volume/header_bytes.h"
#include "server/volume/input_file.h"

namespace intervale {
namespace {

constexpr std::size_t kSignatures = 520;  // bytes of a file, enough for all of these
constexpr std::size_t kEnough = 100;      // files that have a program, to tell which of a folder's most have
constexpr std::size_t kMostFiles = 1 << 20;

// A format that is read by a program of its own.
struct LibraryFormat {
  bool (*begins)(std::string_view start);
  ReaderProgram program;
};
// A DICOM file may begin as TIFF, too.
constexpr std::array<LibraryFormat, 3> kLibraryFormats{
    {{begins_as_dicom, {"read-dicom", "DICOM"}}, {begins_as_tiff, {"read-tiff", "TIFF"}}, {begins_as_hdf5, {"read-hdf5", "HDF5"}}}};

constexpr std::size_t kFolderFormats = 2;  // the first ones of them: volumes in several files

constexpr ReaderProgram kZarr{"read-zarr", "Zarr"};
bool is_zarr(const std::filesystem::path& folder) {
  std::error_code none;
  return std::filesystem::exists(folder / ".zarray", none) || std::filesystem::exists(folder / ".zgroup", none);
}

const ReaderProgram* find_program(std::string_view start) {
  const auto* const found = std::find_if(kLibraryFormats.begin(), kLibraryFormats.end(), [start](const LibraryFormat& f) { return f.begins(start); });
  return found == kLibraryFormats.end() ? nullptr : &found->program;
}

}  // namespace

Result<const ReaderProgram*> find_reader_program(const std::filesystem::path& path) {
  std::error_code error;
  const auto of_file = [](const std::filesystem::path& file) {
    return InputFile::open(file)
        .and_then([](const InputFile& opened) { return read_start(opened, kSignatures); })
        .map(find_program)
        .value_or(nullptr);
  };
  if (!std::filesystem::is_directory(path, error)) return of_file(path);
  if (is_zarr(path)) return &kZarr;
  std::array<std::size_t, kFolderFormats> count{};
  std::size_t files = 0, known = 0;
  const auto end = std::filesystem::recursive_directory_iterator();
  for (auto entry = std::filesystem::recursive_directory_iterator(path, error); !error && entry != end && known < kEnough; entry.increment(error)) {
    std::error_code none;
    if (!entry->is_regular_file(none)) continue;
    if (++files > kMostFiles) return fail(in_quotes(path) + " has too many files to look for a volume in");
    const ReaderProgram* const found = of_file(entry->path());
    for (std::size_t k = 0; k < kFolderFormats; ++k) {
      count[k] += found == &kLibraryFormats[k].program;
      known += found == &kLibraryFormats[k].program;
    }
  }
  if (error) return fail(in_quotes(path) + ": " + error.message());
  const auto most = std::max_element(count.begin(), count.end());
  if (*most == 0) return fail(in_quotes(path) + " is a folder without TIFF or DICOM files, and no Zarr folder");
  return &kLibraryFormats[std::size_t(most - count.begin())].program;
}

}  // namespace intervale
