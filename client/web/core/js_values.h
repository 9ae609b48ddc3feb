// Numbers, boxes, ranges and buffers from JavaScript and to it.
#pragma once

#include <emscripten/val.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "common/patch/shown_range.h"
#include "common/view/lod.h"

namespace intervale {

using emscripten::val;

template <class T>
val buffer_of(const std::vector<T>& items) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(items.data());
  return val(emscripten::typed_memory_view(items.size() * sizeof(T), bytes)).call<val>("slice")["buffer"];
}

template <class Array>
val array_of(const Array& items) {
  val array = val::array();
  for (std::size_t i = 0; i < items.size(); ++i) array.set(i, double(items[i]));
  return array;
}

inline std::array<double, 3> three(const val& array) { return {array[0].as<double>(), array[1].as<double>(), array[2].as<double>()}; }
inline Box box_of(const val& box) { return {three(box["min"]), three(box["max"])}; }

// Pairs of numbers.
inline std::vector<Range> ranges_of(const val& list) {
  std::vector<Range> ranges;
  const auto count = list["length"].as<unsigned>();
  ranges.reserve(count);
  for (unsigned i = 0; i < count; ++i) ranges.push_back({list[i][0].as<double>(), list[i][1].as<double>()});
  return ranges;
}

// null: as much as there is.
inline std::uint64_t limit_of(const val& number) {
  return number.isNull() || number.isUndefined() ? UINT64_MAX : std::uint64_t(std::max(0.0, number.as<double>()));
}

}  // namespace intervale
