// A regular volume of samples, in the type of its file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/grid.h"

namespace intervale {

enum class SampleType : std::uint8_t { u8, i8, u16, i16, u32, i32, f32, f64 };

[[nodiscard]] std::size_t size_of(SampleType type);  // bytes
[[nodiscard]] const char* name_of(SampleType type);  // "u8", "i8", ...

// Samples in the machine's byte order, x fastest, then y, then z; bytes.size() = grid.sample_count() * size_of(type).
struct Volume {
  std::string name;  // the file's name without folders and extension
  Grid grid;
  SampleType type = SampleType::u8;
  std::vector<std::byte> bytes;
};

// Calls visitor with the samples as a std::span<const T> of the volume's own type T, and returns what it returns.
template <class Visitor>
decltype(auto) visit_samples(const Volume& volume, Visitor&& visitor) {
  const auto as = [&]<class T>(T) {
    return visitor(std::span<const T>(reinterpret_cast<const T*>(volume.bytes.data()), volume.bytes.size() / sizeof(T)));
  };
  switch (volume.type) {
    case SampleType::u8:
      return as(std::uint8_t{});
    case SampleType::i8:
      return as(std::int8_t{});
    case SampleType::u16:
      return as(std::uint16_t{});
    case SampleType::i16:
      return as(std::int16_t{});
    case SampleType::u32:
      return as(std::uint32_t{});
    case SampleType::i32:
      return as(std::int32_t{});
    case SampleType::f32:
      return as(float{});
    case SampleType::f64:
      break;
  }
  return as(double{});
}

}  // namespace intervale
