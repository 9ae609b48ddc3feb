// A regular volume of samples, in the type of its file.
#pragma once

#include <boost/mp11/algorithm.hpp>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "common/diamond/grid.h"
#include "common/patch/labels.h"
#include "common/patch/sample_type.h"

namespace intervale {

// Samples in the machine's byte order, x fastest, then y, then z; bytes.size() = grid.sample_count() * components *
// size_of(type).
struct Volume {
  std::string name;  // the file's name without folders and extension
  Grid grid;
  SampleType type = SampleType::u8;
  std::vector<std::byte> bytes;
  Labels labels{};
  unsigned components = 1;  // numbers a sample, side by side: 1, or 3 of a vector
};

// Calls visitor with the samples as a std::span<const T> of the volume's own type T, and returns what it returns.
template <class Visitor>
decltype(auto) visit_samples(const Volume& volume, Visitor&& visitor) {
  return boost::mp11::mp_with_index<std::tuple_size_v<SampleTypes>>(std::size_t(volume.type), [&](auto type) {
    using T = std::tuple_element_t<type, SampleTypes>;
    return visitor(std::span<const T>(reinterpret_cast<const T*>(volume.bytes.data()), volume.bytes.size() / sizeof(T)));
  });
}

}  // namespace intervale
