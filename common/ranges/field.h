// The samples of a field.
#pragma once

#include <cstddef>
#include <span>

#include "common/diamond/diamond.h"

namespace intervale {

// Samples of type T, indexed by vertices inside the box.
template <class T>
struct Field {
  std::span<const T> samples;
  Vertex last;
  [[nodiscard]] std::size_t index(Vertex v) const {
    return (std::size_t(v.z) * std::size_t(last.y + 1) + std::size_t(v.y)) * std::size_t(last.x + 1) + std::size_t(v.x);
  }
  [[nodiscard]] double at(Vertex v) const { return double(samples[index(v)]); }
};

}  // namespace intervale
