// The samples of a box, of which not all need be known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/patch/sample_type.h"

namespace intervale {

// In the machine's byte order, x fastest. Who takes one and a choice of what is wanted reads the samples of that only.
struct SampleView {
  SampleType type = SampleType::u8;
  std::array<std::int32_t, 3> dims{};
  std::span<const std::byte> bytes;  // of all samples
};

}  // namespace intervale
