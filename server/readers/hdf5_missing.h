// Stored numbers of an HDF5 array that stand for no value: _FillValue and missing_value (CF conventions, section 2.5.1); and
// in a file of NetCDF, where there is no _FillValue, what the library fills arrays with that nobody wrote, but for bytes
// (NetCDF User's Guide, "Fill Values"). They become NaN; so integers that have such ones become floats.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <span>
#include <vector>

#include "server/volume/volume_header.h"

namespace intervale {

class MissingNumbers {
 public:
  static MissingNumbers of(hid_t dataset);

  [[nodiscard]] bool any() const { return !numbers_.empty(); }
  // Whether one of the samples is such a number.
  [[nodiscard]] bool are_in(std::span<const std::byte> samples, SampleType type) const;
  // The samples as floats, NaN where there is no value. to: f32 or f64. Only integers are scaled by slope and intercept.
  [[nodiscard]] std::vector<std::byte> as_nan(std::span<const std::byte> samples, SampleType type, SampleType to, double slope,
                                              double intercept) const;

 private:
  std::vector<double> numbers_;
};

// The float type that keeps apart what integers of this type, scaled, are.
[[nodiscard]] SampleType float_type_for(SampleType type, double slope, double intercept);

}  // namespace intervale
