#include "server/readers/tiff_planes.h"

#include <algorithm>

#include "common/util/printable.h"

namespace intervale {
namespace {

constexpr std::uint64_t kNoPage = UINT64_MAX;

// Where a plane is in the order of the pages.
std::uint64_t index_of(const Planes& planes, std::uint64_t slice, std::uint64_t channel, std::uint64_t time_point) {
  std::uint64_t index = 0, stride = 1;
  for (const char axis : planes.order) {
    index += stride * (axis == 'Z' ? slice : axis == 'C' ? channel : time_point);
    stride *= axis == 'Z' ? planes.slices : axis == 'C' ? planes.channels : planes.time_points;
  }
  return index;
}

// What TiffData says. Each plane is set once, so the time is that of the planes and the elements.
Result<std::vector<std::uint64_t>> pages_of(const Planes& planes, const std::vector<TiffData>& data, const Pages& pages, const std::string& where) {
  std::vector<std::uint64_t> found(planes.slices * planes.channels * planes.time_points, kNoPage);
  for (const TiffData& one : data) {
    if (one.slice >= planes.slices || one.channel >= planes.channels || one.time_point >= planes.time_points)
      return fail(where + ": TiffData tells of slice " + std::to_string(one.slice) + ", channel " + std::to_string(one.channel) + ", time point " +
                  std::to_string(one.time_point) + ", which it has not");
    const std::uint64_t first = index_of(planes, one.slice, one.channel, one.time_point);
    const std::uint64_t count = std::min<std::uint64_t>(one.count.value_or(one.directory ? 1 : found.size()), found.size() - first);
    for (std::uint64_t k = 0; k < count; ++k) {
      const std::uint64_t directory = one.directory.value_or(0);
      const auto page = directory + k < k ? std::nullopt : pages.of_directory(directory + k);
      if (!page && !one.count && !one.directory) break;  // as many as there are
      if (!page) return fail(where + ": TiffData names page " + std::to_string(directory + k) + ", which it has not; the first is 0");
      if (found[first + k] != kNoPage) return fail(where + ": TiffData names two pages for one plane");
      found[first + k] = *page;
    }
  }
  const auto missing = std::find(found.begin(), found.end(), kNoPage);
  if (missing != found.end())
    return fail(where + ": TiffData names no page for plane " + std::to_string(missing - found.begin()) + " of " + std::to_string(found.size()));
  return found;
}

}  // namespace

std::uint64_t Planes::page_of(std::uint64_t slice, std::uint64_t channel, std::uint64_t time_point) const {
  const std::uint64_t index = index_of(*this, slice, channel, time_point);
  return pages.empty() ? index : pages[index];
}

Result<Planes> planes_of(const Described& described, const Pages& pages, const std::string& where) {
  const std::uint64_t channels = described.channels, times = described.time_points, all = pages.size();
  const auto elsewhere = std::find_if(described.data.begin(), described.data.end(), [](const TiffData& one) { return one.other_file.has_value(); });
  if (elsewhere != described.data.end())
    return fail(where + ": planes of it are in another file, " +
                (elsewhere->other_file->empty() ? "which it does not name" : "'" + printable(*elsewhere->other_file) + "'") +
                "; a volume's pages must be in one file");
  const bool is_told = !described.data.empty() && described.slices != 0;  // which pages: there may be others, too
  if (channels == 0 || times == 0 || channels > all || times > all || (is_told ? channels * times > all : all % (channels * times) != 0))
    return fail(where + " has " + std::to_string(all) + " pages, which are not those of " + std::to_string(channels) + " channels and " +
                std::to_string(times) + " time points");
  const std::uint64_t slices = all / channels / times;
  if (described.slices != 0 && (is_told ? described.slices > slices : described.slices != slices))
    return fail(where + " has " + std::to_string(all) + " pages, and says that it has " + std::to_string(described.slices) + " slices, " +
                std::to_string(channels) + " channels and " + std::to_string(times) + " time points; are pages missing?");
  Planes planes{is_told ? described.slices : slices, channels, times, described.order, {}};
  if (!is_told) return planes;
  return pages_of(planes, described.data, pages, where).map([&](std::vector<std::uint64_t> found) {
    planes.pages = std::move(found);
    return planes;
  });
}

}  // namespace intervale
