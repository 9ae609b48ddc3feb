// The statistics of a data set in a file, which build and info print, as JSON and as text.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/ivm/interval_volume.h"
#include "common/ivm/value_volume.h"

namespace intervale {

[[nodiscard]] nlohmann::ordered_json stats_of(const IntervalVolume& volume, const std::filesystem::path& file);
[[nodiscard]] std::string text_of(const IntervalVolume& volume, const std::filesystem::path& file);

// Of a data set of every range. The text has the histogram as bars.
[[nodiscard]] nlohmann::ordered_json stats_of(const ValueVolume& volume, const std::filesystem::path& file);
[[nodiscard]] std::string text_of(const ValueVolume& volume, const std::filesystem::path& file);

}  // namespace intervale
