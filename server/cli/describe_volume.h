// The statistics that build and info print, as JSON and as text.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/ivm/interval_volume.h"

namespace intervale {

[[nodiscard]] nlohmann::ordered_json stats_of(const IntervalVolume& volume, std::uint64_t file_bytes);
[[nodiscard]] std::string text_of(const IntervalVolume& volume, std::uint64_t file_bytes);

}  // namespace intervale
