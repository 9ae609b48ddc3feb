#include "server/volume/library_formats.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "server/volume/header_bytes.h"
#include "server/volume/input_file.h"

namespace intervale {
namespace {

constexpr std::size_t kDicomStart = 132;  // bytes of a file, enough to know DICOM
constexpr std::size_t kSignatures = 520;  // bytes of a file, enough for all of these
constexpr std::size_t kEnough = 100;      // files that have a program, to tell which of a folder's most have
constexpr std::size_t kMostFiles = 1 << 20;

// An element of group 8 in implicit VR, little endian (PS3.5, section 7.1.3), with which files may begin.
struct FirstElement {
  unsigned char number;
  std::uint32_t least, most;  // bytes of its value
  const char* characters;     // of its value; nullptr: any
};
constexpr const char* kCodeString = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 _\\";
constexpr const char* kDigits = "0123456789. ";
constexpr std::array<FirstElement, 7> kFirstElements{{{0x00, 4, 4, nullptr},        // length of the group
                                                      {0x01, 4, 4, nullptr},        // length to the end
                                                      {0x05, 2, 256, kCodeString},  // character set
                                                      {0x08, 2, 256, kCodeString},  // image type
                                                      {0x12, 8, 10, kDigits},       // date of creation
                                                      {0x16, 10, 64, kDigits},      // class
                                                      {0x18, 10, 64, kDigits}}};    // instance

bool begins_as_implicit_dicom(std::string_view start) {
  constexpr std::string_view kGroup("\x08\0", 2);
  if (start.size() < 8 || !start.starts_with(kGroup) || start[3] != 0) return false;
  const HeaderBytes bytes(start, false);
  const auto length = bytes.number<std::uint32_t>(4);
  const auto number = static_cast<unsigned char>(start[2]);
  const auto* const first = std::find_if(kFirstElements.begin(), kFirstElements.end(), [&](const FirstElement& e) { return e.number == number; });
  if (first == kFirstElements.end() || length < first->least || length > first->most || length % 2 != 0) return false;
  std::string_view value = start.substr(8, length);
  if (value.size() == length && value.ends_with('\0')) value.remove_suffix(1);
  if (first->characters != nullptr && value.find_first_not_of(first->characters) != std::string_view::npos) return false;
  // What follows has a greater number, and no length of a megabyte.
  const std::size_t next = 8 + std::size_t(length);
  if (next + 8 > start.size()) return first->characters != nullptr && start.size() >= kDicomStart;
  return start.substr(next, 2) == kGroup && bytes.number<std::uint16_t>(next + 2) > number && bytes.number<std::uint32_t>(next + 4) < 1u << 20;
}

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

bool begins_as_dicom(std::string_view start) {
  using namespace std::string_view_literals;
  if (start.size() >= kDicomStart && start.substr(128, 4) == "DICM"sv) return true;
  for (const auto first : {"\x02\0\0\0UL"sv, "\x08\0\0\0UL"sv, "\x08\0\x05\0CS"sv, "\x08\0\x08\0CS"sv, "\x08\0\x16\0UI"sv}) {
    if (start.starts_with(first)) return true;
  }
  return begins_as_implicit_dicom(start.substr(0, kDicomStart));
}

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
