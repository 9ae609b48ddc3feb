// Where the samples of an HDF5 array lie: by element_size_um (z, y, x: ilastik and others), or by the coordinate variables of
// NetCDF (dimension scales). What neither says is counted in samples.
#pragma once

#include <hdf5.h>

#include <array>
#include <string>

#include "common/diamond/affine.h"
#include "common/util/result.h"

namespace intervale {

struct Hdf5Places {
  Affine affine;
  std::string unit;  // of length; may be empty
};

// zyx: the array's last three axes. Fails if coordinates are not evenly spaced, and says where; the message begins with
// `where`.
[[nodiscard]] Result<Hdf5Places> places_of(hid_t dataset, const std::array<hsize_t, 3>& zyx, const std::string& where);

}  // namespace intervale
