// Raw samples without a header; the user gives the layout.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "common/patch/volume.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

struct RawLayout {
  std::array<std::int64_t, 3> dims{};  // samples on x (fastest), y, z
  SampleType type = SampleType::u8;
  bool big_endian = false;
  std::uint64_t skip_bytes = 0;  // before the first sample
  Affine affine;
};

// "u8", "i8", "u16", "i16", "u32", "i32", "f32" or "f64"; misuse with that list otherwise.
INTERVALE_EXPORT Result<SampleType> parse_sample_type(std::string_view name);

}  // namespace intervale
