// What the header of a volume's file says: what the samples are, where they lie in the world, and how they are stored.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "common/patch/volume.h"
#include "common/util/result.h"
#include "server/volume/input_file.h"

namespace intervale {

enum class Encoding : std::uint8_t { raw, deflate, bzip2, text, library };  // deflate: as gzip or zlib wraps it; library: see child_reader.h

inline constexpr unsigned kMostComponents = 16;

// One of several volumes in a file or folder.
struct VolumePart {
  std::string name;   // by which it is chosen; any bytes
  std::string about;  // a few words for a person; any bytes
};

struct VolumeHeader {
  const char* format = "";  // name of the file's format
  Grid grid;
  Labels labels;
  SampleType type = SampleType::u8;
  unsigned components = 1;                  // numbers a sample: 1 to kMostComponents
  std::optional<std::uint64_t> component;   // the one of several to be read; none: all
  std::optional<std::uint64_t> time_point;  // which was chosen
  std::uint64_t time_points = 1;            // volumes of this shape, one after the other
  double slope = 1, intercept = 0;          // value = slope * stored number + intercept; both finite, slope not 0
  std::string parts_are;                    // what the parts are, if there are several: "series", "channels", "arrays"
  std::vector<VolumePart> parts;            // if there are several, of which the header describes one
  Encoding encoding = Encoding::raw;
  bool big_endian = false;
  std::optional<std::string> data_file;  // as written, unchecked; none: the header's own file
  std::uint64_t data_offset = 0;         // where an attached header ends, in bytes of the file
  // The data is base64 text up to the first other character; before it there are so many bytes of what that stands for.
  std::optional<std::uint64_t> base64_skip;
  std::uint64_t coded_bytes = UINT64_MAX;  // of deflate, bzip2 and base64: bytes of the coded data, if they are known
  std::uint32_t line_skip = 0;             // lines to skip in the file that holds the data; after them
  std::int64_t byte_skip = 0;              // bytes to skip, of the decoded data; -1 - n: the data ends n bytes before the end

  [[nodiscard]] std::uint64_t data_bytes() const { return grid.sample_count() * components * size_of(type); }  // of one time point
  // Whether samples are as many, and as they are stored, as another header says.
  [[nodiscard]] bool is_alike(const VolumeHeader& other) const {
    const auto facts = [](const VolumeHeader& h) { return std::tie(h.grid.dims, h.type, h.components, h.component, h.slope, h.intercept); };
    return facts(*this) == facts(other);
  }
};

// Fails if there is no time point, or if the bytes of all have no number. The message begins with `where`.
[[nodiscard]] Result<void> check_size(const VolumeHeader& header, const std::string& where);

// Fails if a sample has no number or more than kMostComponents. The message begins with `where`.
[[nodiscard]] Result<void> check_components(std::uint64_t components, const std::string& where);

// The time point to read: without a choice the only one. To choose none of several, or one that is not there, is misuse.
[[nodiscard]] Result<std::uint64_t> check_time_point(const VolumeHeader& header, std::optional<std::uint64_t> time_point, const std::string& where);

// The least and the greatest of stored numbers. NaN is neither.
struct StoredRange {
  double least = std::numeric_limits<double>::infinity(), greatest = -std::numeric_limits<double>::infinity();  // of none
  void add(const Volume& volume);
};
// The type of the values of stored numbers: of integers if slope and intercept are whole and one holds them all, else
// f32 if that keeps apart what the stored numbers do, else f64. A slope of 1 and an intercept of 0 change nothing.
[[nodiscard]] SampleType rescaled_type(SampleType stored, const StoredRange& range, double slope, double intercept);
// Makes values of stored numbers. to: their type, as it is for these numbers and others.
void rescale(Volume& volume, double slope, double intercept, SampleType to);
// The same, of numbers that are all there are.
void rescale(Volume& volume, double slope, double intercept);

}  // namespace intervale
