// The least and the largest samples of small blocks of a field: which of them can matter for an error.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/ranges/field.h"
#include "common/util/parallel.h"

namespace intervale {

// The least and the largest sample of every block of kSide^3 samples; the last blocks are smaller.
template <class T>
struct Extremes {
  static constexpr std::int32_t kSide = 8;
  std::array<std::int32_t, 3> size{};
  std::vector<std::array<T, 2>> block;
  bool is_partial = false;  // some blocks are left out: their least sample is greater than their largest

  // Of some blocks, a bit each; the samples of the others are not read.
  Extremes(const Field<T>& field, const ParallelFor& parallel, const std::vector<bool>& some)
      : size{field.last.x / kSide + 1, field.last.y / kSide + 1, field.last.z / kSide + 1},
        block(some.size(), {std::numeric_limits<T>::max(), std::numeric_limits<T>::lowest()}),
        is_partial(true) {
    parallel(std::size_t(size[2]), [&](std::size_t slice) {
      const auto k = std::int32_t(slice);
      for (std::int32_t j = 0; j < size[1]; ++j) {
        for (std::int32_t i = 0; i < size[0]; ++i) {
          std::array<T, 2>& of_block = at(i, j, k);
          if (!some[std::size_t(&of_block - block.data())]) continue;
          const std::int32_t end = std::min((i + 1) * kSide, field.last.x + 1);
          for (std::int32_t z = k * kSide; z <= std::min(k * kSide + kSide - 1, field.last.z); ++z) {
            for (std::int32_t y = j * kSide; y <= std::min(j * kSide + kSide - 1, field.last.y); ++y) {
              const T* const row = &field.samples[field.index({0, y, z})];
              for (std::int32_t x = i * kSide; x < end; ++x) of_block = {std::min(of_block[0], row[x]), std::max(of_block[1], row[x])};
            }
          }
        }
      }
    });
  }

  // Of all.
  Extremes(const Field<T>& field, const ParallelFor& parallel)
      : size{field.last.x / kSide + 1, field.last.y / kSide + 1, field.last.z / kSide + 1},
        block(std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2])) {
    parallel(std::size_t(size[2]), [&](std::size_t slice) {
      const auto k = std::int32_t(slice);
      std::vector<T> least(std::size_t(field.last.x) + 1), most(least.size());  // of a column of rows
      for (std::int32_t j = 0; j < size[1]; ++j) {
        const Vertex first{0, j * kSide, k * kSide};
        const T* const start = &field.samples[field.index(first)];
        std::copy_n(start, least.size(), least.begin());
        std::copy_n(start, most.size(), most.begin());
        for (std::int32_t z = first.z; z <= std::min(first.z + kSide - 1, field.last.z); ++z) {
          for (std::int32_t y = first.y; y <= std::min(first.y + kSide - 1, field.last.y); ++y) {
            const T* const row = &field.samples[field.index({0, y, z})];
            for (std::size_t x = 0; x < least.size(); ++x) {
              least[x] = std::min(least[x], row[x]);
              most[x] = std::max(most[x], row[x]);
            }
          }
        }
        for (std::int32_t i = 0; i < size[0]; ++i) {
          const auto begin = std::ptrdiff_t(i) * kSide, end = std::min<std::ptrdiff_t>(begin + kSide, std::ptrdiff_t(least.size()));
          at(i, j, k) = {*std::min_element(least.begin() + begin, least.begin() + end), *std::max_element(most.begin() + begin, most.begin() + end)};
        }
      }
    });
  }
  [[nodiscard]] std::array<T, 2>& at(std::int32_t i, std::int32_t j, std::int32_t k) {
    return block[(std::size_t(k) * std::size_t(size[1]) + std::size_t(j)) * std::size_t(size[0]) + std::size_t(i)];
  }
  [[nodiscard]] const std::array<T, 2>& at(std::int32_t i, std::int32_t j, std::int32_t k) const { return const_cast<Extremes*>(this)->at(i, j, k); }
};

}  // namespace intervale
