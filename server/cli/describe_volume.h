// What build and info say of an interval volume.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/ivm/interval_volume.h"

namespace intervale {

[[nodiscard]] nlohmann::ordered_json figures_of(const IntervalVolume& volume, std::uint64_t file_bytes);
[[nodiscard]] std::string text_of(const IntervalVolume& volume, std::uint64_t file_bytes);

}  // namespace intervale
