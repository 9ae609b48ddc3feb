#include "server/volume/volume_header.h"

namespace intervale {

Result<void> check_size(const VolumeHeader& header, const std::string& where) {
  constexpr std::uint64_t kMostNumbers = std::uint64_t(1) << 60;  // so that their bytes have a number
  if (header.time_points == 0) return fail(where + " has no time point");
  const std::uint64_t numbers = kMostNumbers / header.components / header.time_points;
  if (header.grid.sample_count() > numbers) return fail(where + " has too many samples");
  return {};
}

Result<void> check_components(std::uint64_t components, const std::string& where) {
  if (components >= 1 && components <= kMostComponents) return {};
  return fail(where + " has " + std::to_string(components) + " numbers a sample; 1 to " + std::to_string(kMostComponents) + " are read");
}

Result<std::uint64_t> check_time_point(const VolumeHeader& header, std::optional<std::uint64_t> time_point, const std::string& where) {
  const std::string last = std::to_string(header.time_points - 1);
  if (!time_point && header.time_points > 1)
    return misuse(where + " has " + std::to_string(header.time_points) + " time points: choose one, 0 to " + last + ", with --time-point");
  if (time_point.value_or(0) >= header.time_points)
    return misuse(where + " has no time point " + std::to_string(*time_point) + ": the last one is " + last);
  return time_point.value_or(0);
}

}  // namespace intervale
