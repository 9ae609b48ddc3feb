// A regular volume of samples, in the type of its file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
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

// Samples first to last on x, y and z, from 0; both count.
struct SampleBox {
  std::array<std::int64_t, 3> first{}, last{};
};

}  // namespace intervale
