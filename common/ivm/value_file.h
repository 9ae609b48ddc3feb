// Data sets of every range as files (.ivm). FORMAT.md is the specification.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/ivm_container.h"
#include "common/ivm/kept_pages.h"
#include "common/ivm/page_bounds.h"
#include "common/ivm/page_faults.h"
#include "common/ivm/value_volume.h"
#include "common/patch/shown_range.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// Whether a file is a data set of every range, from its beginning. False if it cannot be read, or is of another version:
// those who open it say why.
[[nodiscard]] bool is_value_file(const std::filesystem::path& path);

// The file's bytes. Equal volumes give equal bytes, whatever `parallel` is; the name is not stored. kept: as of
// encode_ivm().
[[nodiscard]] std::vector<std::byte> encode_values(const ValueVolume& volume, const ParallelFor& parallel = serial, KeptPages* kept = nullptr);

// All streams but those of pages, of their index, of their bounds and of channels. Of the parts, description and weights.
[[nodiscard]] Streams encode_field(const ValueVolume::Parts& parts);
// The stream of the bounds of all pages; none for a single one.
void append_bounds(Streams& streams, std::span<const PageBounds> bounds);

// The inverse, for bytes from outside: checks every checksum, and that the bytes can hold as many values as they claim
// before it allocates. `parallel`, room and faults: as of decode_ivm(); what of_every_range() takes is included.
[[nodiscard]] Result<ValueVolume> decode_values(std::span<const std::byte> bytes, std::string name, const ParallelFor& parallel = serial,
                                                std::uint64_t room = kAnyRoom, PageFaults* faults = nullptr);

// The most memory, in bytes, that decoding takes besides the file's bytes, with what of_every_range() makes of it: of
// the scales from `finest` on, or all. grid: of at most kMostSamples. last: of the format.
[[nodiscard]] std::uint64_t memory_to_decode(const Grid& grid, ValueKey last, int finest = 0);

// What is told of a data set without its values. memory_bytes: as ValueVolume's. file_bytes: of its file; 0: not known.
struct ValueSummary {
  FieldDescription description;
  std::uint64_t updates = 0, supercubes = 0, memory_bytes = 0, file_bytes = 0;
  friend bool operator==(const ValueSummary&, const ValueSummary&) = default;
};
[[nodiscard]] ValueSummary summary_of(const ValueVolume& volume, std::uint64_t file_bytes);
// Of a file, by all of it but its pages: those are not looked at. Checks the rest as decode_values() does. Some
// milliseconds at most.
[[nodiscard]] Result<ValueSummary> decode_summary(const FileEnds& file, std::string name);
// Where the pages lie that it does without, from the first kMostHeadBytes of a file, or more, or all. nullopt: it needs
// the file whole, which is of one range, or has channels.
[[nodiscard]] Result<std::optional<StreamPlace>> pages_beside_summary(std::span<const std::byte> start, std::uint64_t file_bytes);
// decode_summary() of a file, of which no more is read; nullopt as of pages_beside_summary(). The name is the file's.
// Errors begin with the path.
[[nodiscard]] Result<std::optional<ValueSummary>> load_summary(const std::filesystem::path& path);

// Of a file whose ends are there (coarse_scales.h): the scales from `finest` on, 1 at least, whose pages the first end has.
// Channels are left out. Checks all that is there as decode_values() does.
[[nodiscard]] Result<ValueVolume> decode_coarse_values(const FileEnds& file, std::string name, int finest, const ParallelFor& parallel = serial);

// What some ranges need of a file, which is not all of its pages (page_bounds.h).
struct NeededPages {
  std::vector<bool> pages;          // for each whether it is to be read, with those that are little between two others
  std::vector<StreamPlace> places;  // where in the file those are, without what file.first has; ascending, neighbours as one
};
// file: all but its pages, at least. nullopt: all of the file is to be read, which has no bounds, or has channels, or claims
// more values than what is needed may hold.
[[nodiscard]] Result<std::optional<NeededPages>> needed_pages(const FileEnds& file, const ShownRanges& shown);
// Of these pages: file.first ends with their bytes, in order. The values for other ranges than `shown` are wrong; for
// these all is as in the whole file: relevant updates, their values and errors, and where surfaces are. Checks all that
// is there as decode_values() does.
[[nodiscard]] Result<ValueVolume> decode_needed_values(const FileEnds& file, std::string name, const std::vector<bool>& pages,
                                                       const ParallelFor& parallel = serial);

// Writes a temporary file and renames it. Returns the number of bytes.
[[nodiscard]] Result<std::uint64_t> save_values(const std::filesystem::path& path, const ValueVolume& volume, const ParallelFor& parallel = serial,
                                                KeptPages* kept = nullptr);

// Checks the header and the length before it allocates, then decode_values; the name is the file's, without folders and
// extension. Errors begin with the path.
[[nodiscard]] Result<std::shared_ptr<const ValueVolume>> load_values(const std::filesystem::path& path, const ParallelFor& parallel = serial,
                                                                     PageFaults* faults = nullptr);

}  // namespace intervale
