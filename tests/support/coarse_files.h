// Files of every range that are read scale by scale.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "common/ivm/coarse_scales.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/parallel/all_cores.h"
#include "server/builder/value_builder.h"
#include "tests/support/value_fields.h"

namespace intervale::coarse_files {

using Dims = std::array<std::int32_t, 3>;
using SharedVolume = std::shared_ptr<const IntervalVolume>;
using Bytes = std::vector<std::byte>;

inline Bytes file_of(const Dims& dims, unsigned seed) {
  Volume volume = testing::random_value_field(dims, seed).volume;
  const testing::ValueField field = testing::random_value_field(dims, seed);
  return encode_values(build_value_volume(volume, field.format), on_all_cores);
}

inline std::vector<CoarseScales> scales_of(const Bytes& file) {
  const auto scales = coarse_scales(std::span(file).first(std::min(file.size(), kStartBytes)), file.size());
  EXPECT_TRUE(scales) << scales.error().message;
  return scales ? *scales : std::vector<CoarseScales>();
}

inline FileEnds ends_of(const Bytes& file, const CoarseScales& scales) {
  return {std::span(file).first(scales.first_bytes), std::span(file).last(scales.last_bytes), file.size()};
}

inline SharedVolume coarse(const Bytes& file, const CoarseScales& scales) {
  auto volume = decode_coarse(ends_of(file, scales), scales, "made", on_all_cores);
  EXPECT_TRUE(volume) << volume.error().message;
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

inline SharedVolume whole(const Bytes& file) { return std::make_shared<const IntervalVolume>(decode_volume(file, "made", on_all_cores).value()); }

// Of several pages, in one scale or two that can be had before the rest.
inline constexpr std::array<std::pair<Dims, unsigned>, 3> kFiles{{{{300, 60, 20}, 4}, {{70, 67, 66}, 0}, {{134, 130, 129}, 1}}};
inline const Bytes& large() {
  static const Bytes file = std::apply(file_of, kFiles.back());
  return file;
}

}  // namespace intervale::coarse_files
