// The types of samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>

#include "common/util/export.h"

namespace intervale {

enum class SampleType : std::uint8_t { u8, i8, u16, i16, u32, i32, f32, f64 };
inline constexpr int kSampleTypes = 8;
// Their C++ types, in the same order.
using SampleTypes = std::tuple<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t, std::int32_t, float, double>;

[[nodiscard]] INTERVALE_EXPORT std::size_t size_of(SampleType type);  // bytes
[[nodiscard]] INTERVALE_EXPORT const char* name_of(SampleType type);  // "u8", "i8", ...
[[nodiscard]] constexpr bool is_float(SampleType type) { return type == SampleType::f32 || type == SampleType::f64; }

}  // namespace intervale
