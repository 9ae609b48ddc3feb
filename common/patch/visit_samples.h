// The samples of a volume in the C++ type that they have.
#pragma once

#include <boost/mp11/algorithm.hpp>
#include <cstddef>
#include <span>
#include <tuple>
#include <utility>

#include "common/patch/sample_type.h"
#include "common/patch/volume.h"

namespace intervale {

// Calls visitor with the samples as a std::span<const T> of their own type T, and returns what it returns.
template <class Visitor>
decltype(auto) visit_samples(SampleType of, std::span<const std::byte> bytes, Visitor&& visitor) {
  return boost::mp11::mp_with_index<std::tuple_size_v<SampleTypes>>(std::size_t(of), [&](auto type) {
    using T = std::tuple_element_t<type, SampleTypes>;
    return visitor(std::span<const T>(reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)));
  });
}
template <class Visitor>
decltype(auto) visit_samples(const Volume& volume, Visitor&& visitor) {
  return visit_samples(volume.type, volume.bytes, std::forward<Visitor>(visitor));
}

}  // namespace intervale
