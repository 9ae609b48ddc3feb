// The statistics of a data set in a file, which build and info print, as JSON and as text.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "common/ivm/interval_volume.h"
#include "common/ivm/value_file.h"

namespace intervale {

// A line for each channel.
[[nodiscard]] std::string text_of(std::span<const Channel> channels);

[[nodiscard]] nlohmann::ordered_json stats_of(const IntervalVolume& volume, std::uint64_t file_bytes);
[[nodiscard]] std::string text_of(const IntervalVolume& volume, std::uint64_t file_bytes);

// For them; 0: it cannot be told.
[[nodiscard]] std::uint64_t file_size_of(const std::filesystem::path& file);

// Of a data set of every range. The text has the histogram as bars.
[[nodiscard]] nlohmann::ordered_json stats_of(const ValueSummary& set);
[[nodiscard]] std::string text_of(const ValueSummary& set);

}  // namespace intervale
