// The container of .ivm files: a header, a table of streams, the streams. FORMAT.md is the specification.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <new>
#include <optional>
#include <span>
#include <vector>

#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr std::uint32_t kIvmVersion = 5;

enum class StreamType : std::uint32_t {
  field = 1,
  weights = 2,
  page_index = 3,
  pages = 4,
  // every range only
  histogram = 5,
  volumes = 6,
  // one range only
  range = 7,
  bricks = 8,
  masks = 9,
  occupancy = 10,
  errors = 11,
  error_to_distance = 12,
  error_steps = 13,
  // both
  labels = 14,
  // both, if values need a table
  value_table = 15,
  // both, if there are channels
  channels = 16,
  channel_pages = 17,
  // one range only, if they are known
  update_slopes = 18,
  // every range only, if there are several pages; files of older programs have none
  page_bounds = 19,
};
inline constexpr std::uint32_t kStreamTypes = 20;  // and one more, as 0 is none

enum class FileScope { every_range, one_range };  // of which ranges a data set is

// Thrown where contents would take more memory than there is room for.
struct NoRoom : std::bad_alloc {
  [[nodiscard]] const char* what() const noexcept override { return "takes more memory than is left"; }
};
inline constexpr std::uint64_t kAnyRoom = ~std::uint64_t(0);  // as much as the system has

// The streams of a file, by type. A scope has some of the types; the others are empty.
class Streams {
 public:
  [[nodiscard]] std::vector<std::byte>& operator[](StreamType type) { return bytes_[std::size_t(type)]; }
  [[nodiscard]] const std::vector<std::byte>& operator[](StreamType type) const { return bytes_[std::size_t(type)]; }

 private:
  std::array<std::vector<std::byte>, kStreamTypes> bytes_;
};

// Adds numbers to a stream as they lie in memory: no padding, little endian.
template <class T>
void append(std::vector<std::byte>& out, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

[[nodiscard]] inline std::span<const std::uint8_t> octets(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

// The file's bytes.
[[nodiscard]] std::vector<std::byte> make_container(FileScope scope, const Streams& streams);

// What is there of a file: its first bytes and its last, in order; together no more than all of it.
struct FileEnds {
  std::span<const std::byte> first, last;
  std::uint64_t file_bytes = 0;
};

// The streams of pages that are written elsewhere: their sizes in bytes.
struct PagesElsewhere {
  std::uint64_t pages_bytes = 0, channel_pages_bytes = 0;
  std::uint64_t channel_pages_checksum = 0;  // XXH3-64
};
// A file without its streams of pages.
struct ContainerFrame {
  struct Piece {
    std::uint64_t offset = 0;  // in the file
    std::vector<std::byte> bytes;
  };
  std::vector<Piece> pieces;  // the first one begins with the header, which has all checksums
  std::uint64_t pages_at = 0, channel_pages_at = 0;
  std::uint64_t file_bytes = 0;
};
[[nodiscard]] ContainerFrame make_frame(FileScope scope, const Streams& streams, const PagesElsewhere& elsewhere);

// A file from outside: its header, table and checksums are in order, and it has the streams of its scope; optional ones
// of an unknown type are skipped, once their checksums were checked. Pages have checksums of their own, which whoever
// reads them must check. value_table, update_slopes, page_bounds and the streams of channels are empty if the file has none.
class Container {
 public:
  // The file must outlive the result. Fails, in one line, if it is not a file of this scope. room: of bytes, for claim().
  // tolerates_damage: the pages of channels are left to their own checksums, too.
  static Result<Container> open(std::span<const std::byte> file, FileScope scope, std::uint64_t room = kAnyRoom, bool tolerates_damage = false);

  // The same, of a file of which only the ends are there: of the pages, as many bytes as the first end has. Fails if another
  // stream is not there whole. The ends must outlive the result.
  static Result<Container> open_ends(const FileEnds& file, FileScope scope);

  // What will be allocated for its contents, at most: throws NoRoom if all claims exceed the room. Called before anything
  // is allocated.
  void claim(std::uint64_t bytes) const;

  [[nodiscard]] std::uint64_t content_hash() const { return content_hash_; }  // Description::content_hash: that of the header, and of channels
  [[nodiscard]] std::size_t file_bytes() const { return file_bytes_; }
  // The bytes of a stream of the scope.
  [[nodiscard]] std::span<const std::byte> operator[](StreamType type) const { return streams_[std::size_t(type)]; }
  // The same, of a stream that must have so many bytes.
  [[nodiscard]] Result<std::span<const std::byte>> stream(StreamType type, std::size_t bytes) const;

 private:
  template <class BytesOf>
  static Result<Container> open_streams(std::span<const std::byte> start, std::uint64_t file_bytes, FileScope scope, bool tolerates_damage,
                                        const BytesOf& bytes_of);
  std::uint64_t content_hash_ = 0;
  std::size_t file_bytes_ = 0;
  mutable std::uint64_t room_ = kAnyRoom;  // that is left
  std::array<std::span<const std::byte>, kStreamTypes> streams_;
};

// The most bytes that a header and its table take.
inline constexpr std::size_t kMostHeadBytes = 2088;

// Checks the header and the table that a file begins with, before the rest of it is there. start: its first
// kMostHeadBytes, or more, or all of a shorter file. file_bytes: how long the file is; off: it is not known, and as long
// as its header says. Returns that length. Fails, in one line, if this is not the beginning of an .ivm file of this version.
[[nodiscard]] Result<std::uint64_t> check_container_start(std::span<const std::byte> start, std::optional<std::uint64_t> file_bytes);

// Where a stream lies in a file.
struct StreamPlace {
  std::uint64_t offset = 0, bytes = 0;
};
// Of a scope's file that begins with `start`, as of check_container_start(); no bytes where it has no such stream.
[[nodiscard]] Result<StreamPlace> place_of(StreamType type, std::span<const std::byte> start, std::uint64_t file_bytes, FileScope scope);

// Whether a file begins as an .ivm file of any version, whole or not.
[[nodiscard]] bool begins_as_ivm(const std::filesystem::path& path);

// The scope of a file, from its beginning. Nothing if it cannot be read, or is not a whole file of this version: those
// who open it say why.
[[nodiscard]] std::optional<FileScope> scope_of(const std::filesystem::path& path);

// The same, from the bytes that a file begins with, as of check_container_start().
[[nodiscard]] Result<FileScope> scope_of(std::span<const std::byte> start, std::uint64_t file_bytes);

// The same, from all of a file's bytes.
[[nodiscard]] std::optional<FileScope> scope_of(std::span<const std::byte> file);

// The bytes of a file, for Container::open. Checks the header, the scope if one is given, and the length first, and
// allocates nothing for another file. Errors begin with the path. `parallel` may stop it.
[[nodiscard]] Result<std::vector<std::byte>> read_container(const std::filesystem::path& path, std::optional<FileScope> scope,
                                                            const ParallelFor& parallel = serial);

// Parts of a file. One thread at a time.
class FileParts {
 public:
  // First. Fails if it is no file whose length is known.
  [[nodiscard]] Result<void> open(const std::filesystem::path& path);
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  // of the file
  // Within the file.
  [[nodiscard]] Result<std::vector<std::byte>> read(std::uint64_t first, std::uint64_t bytes);

 private:
  std::ifstream in_;
  std::uint64_t bytes_ = 0;
};

// Writes a temporary file and renames it. Errors name the path.
[[nodiscard]] Result<void> save_container(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace intervale
