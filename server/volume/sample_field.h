// A sample volume of any size and type, of which any rows are computed when they are asked for: a volume need not fit
// the memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "common/patch/volume.h"
#include "common/util/result.h"
#include "server/volume/sample_rows.h"

namespace intervale {

inline constexpr int kMaxFieldSize = 8192;  // samples a side

// Immutable. Memory: O(size).
class SampleField {
 public:
  // Misuse for an unknown name, or a size that is not kMinSampleSize to kMaxFieldSize.
  static Result<SampleField> create(std::string_view name, int size, SampleType type);

  // All but the samples.
  [[nodiscard]] const Volume& header() const { return header_; }
  [[nodiscard]] std::size_t row_bytes() const { return places_ * size_of(header_.type); }  // size samples along x
  [[nodiscard]] std::uint64_t rows() const { return std::uint64_t(places_) * places_; }    // number j + size * k is at j on y and at k on z

  // The rows from number `first` on that out has room for, on all cores. out: whole rows, aligned for the type. What comes
  // does not depend on the number of threads, nor on how the rows are divided among calls.
  //
  // Floats are the values of the formula. For whole numbers its nominal range is mapped linearly onto the range of the
  // type, least to least and greatest to greatest, and rounded to the nearest, halves upwards; what lies beyond is
  // clamped. So 0 to 255 are merely rounded as u8, and those of i8 are 128 less.
  void fill(std::uint64_t first, std::span<std::byte> out) const;

 private:
  SampleField(const SampleFormula& formula, int size, SampleType type);
  const SampleFormula* formula_;
  Volume header_;
  std::size_t places_;
  SampleRow row_;
};

}  // namespace intervale
