// The statistics of an interval volume in a file, which build and info print, as JSON and as text.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/ivm/interval_volume.h"

namespace intervale {

[[nodiscard]] nlohmann::ordered_json stats_of(const IntervalVolume& volume, const std::filesystem::path& file);
[[nodiscard]] std::string text_of(const IntervalVolume& volume, const std::filesystem::path& file);

}  // namespace intervale
