#include "common/ivm/coarse_scales.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "common/codec/coding_rate.h"
#include "common/diamond/domain.h"
#include "common/diamond/grid.h"
#include "common/ivm/distance_codes.h"
#include "common/ivm/every_range.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_page.h"
#include "common/ivm/value_streams.h"
#include "common/view/screen_error.h"

namespace intervale {
namespace {

bool lies_within(const StreamPlace& place, std::size_t bytes) { return place.bytes <= bytes && place.offset <= bytes - place.bytes; }

// The dims of a field's record. They are not checked.
Grid grid_of(std::span<const std::byte> record) {
  Grid grid;
  std::memcpy(grid.dims.data(), record.data(), sizeof grid.dims);
  return grid;
}

// Of the updates that are there.
int finest_scale(const IntervalVolume& volume) { return scale_of_key(volume.set().bricks().back().key); }

}  // namespace

std::uint64_t start_bytes(std::span<const std::byte> start, std::uint64_t file_bytes) {
  constexpr std::uint64_t kMostIndex = 16 * (kMostSamples >> 16);  // bytes; of pages a quarter as full as they may be
  const auto scope = scope_of(start, file_bytes);
  if (!scope || *scope != FileScope::every_range) return start.size();
  const auto index = place_of(StreamType::page_index, start, file_bytes, *scope);
  if (!index || index->bytes > kMostIndex || index->offset > file_bytes || index->bytes > file_bytes - index->offset) return start.size();
  return std::max<std::uint64_t>(start.size(), index->offset + index->bytes);
}

Result<std::vector<CoarseScales>> coarse_scales(std::span<const std::byte> start, std::uint64_t file_bytes) {
  const auto scope = scope_of(start, file_bytes);
  if (!scope) return tl::unexpected(scope.error());
  std::vector<CoarseScales> scales;
  if (*scope != FileScope::every_range) return scales;
  const auto place = [&](StreamType type) { return place_of(type, start, file_bytes, *scope).value_or(StreamPlace()); };
  const StreamPlace field = place(StreamType::field), index = place(StreamType::page_index), pages = place(StreamType::pages);
  if (place(StreamType::channels).bytes != 0 || !lies_within(field, start.size()) || !lies_within(index, start.size())) return scales;
  if (field.bytes < sizeof(Grid::dims)) return scales;
  const Grid grid = grid_of(start.subspan(std::size_t(field.offset)));
  const auto has_samples = [](std::int32_t samples) { return samples >= kMinSide && samples <= kMaxSide; };
  if (!std::all_of(grid.dims.begin(), grid.dims.end(), has_samples) || grid.sample_count() > kMostSamples ||
      grid.sample_count() > most_coded_bits(pages.bytes) + kRootVertices)
    return scales;
  const std::vector<std::uint64_t> lengths = page_lengths(start.subspan(std::size_t(index.offset), std::size_t(index.bytes)));
  const Domain domain(grid.dims);
  std::vector<BlockSize> blocks;
  for (int finest = domain.levels() - 1; finest > 0; --finest) {
    const std::vector<BlockSize> of_scale = block_sizes(domain, finest);
    blocks.insert(blocks.end(), of_scale.begin(), of_scale.end());
    const std::size_t count = page_starts(blocks).size();
    if (count >= lengths.size()) break;
    CoarseScales next{finest, pages.offset, file_bytes - pages.offset - pages.bytes};
    for (std::size_t page = 0; page < count; ++page) next.first_bytes += std::min(lengths[page], file_bytes);
    if (next.first_bytes > pages.offset + pages.bytes) break;
    if (count == 1) scales.clear();  // the first page has this scale, too
    scales.push_back(next);
  }
  return scales;
}

Result<IntervalVolume> decode_coarse(const FileEnds& file, const CoarseScales& scales, std::string name, const ParallelFor& parallel) {
  auto values = decode_coarse_values(file, std::move(name), scales.finest, parallel);
  if (!values) return tl::unexpected(values.error());
  return of_every_range(std::move(*values).take(), parallel);
}

// With a camera, how far surfaces move is measured in the whole data set.
bool wants_finer(const IntervalVolume& volume, const Lod& lod) {
  if (volume.is_whole()) return false;
  const double threshold = error_of(lod, volume.description().max_error);
  return threshold <= 0 || lod.camera || double(volume.error_of_finer()) > threshold;
}

bool estimates_want_finer(const IntervalVolume& volume, const Lod& lod) {
  if (volume.is_whole()) return false;
  Lod others = lod;
  others.camera.reset();
  if (!wants_finer(volume, others)) return false;
  if (!lod.camera) return true;
  const Grid& grid = volume.description().grid;
  ScreenError::Region box;
  for (std::size_t axis = 0; axis < 3; ++axis) box.middle[axis] = box.reach[axis] = double(grid.dims[axis] - 1) / 2;
  const double width = std::ldexp(diamond_width(grid), finest_scale(volume) - 1);
  return width / 2 * ScreenError(*lod.camera, grid).pixels_per_unit(box) > lod.camera->pixel_error;
}

Result<std::shared_ptr<const IntervalVolume>> load_coarse_volume(const std::filesystem::path& path, const IntervalVolume* held,
                                                                 const ParallelFor& parallel) {
  FileParts file;
  if (auto opened = file.open(path); !opened) return tl::unexpected(opened.error());
  const std::uint64_t bytes = file.bytes();
  auto start = file.read(0, std::min<std::uint64_t>(bytes, kStartBytes));
  if (!start) return tl::unexpected(start.error());
  if (const std::uint64_t needed = start_bytes(*start, bytes); needed > start->size()) {
    start = file.read(0, needed);
    if (!start) return tl::unexpected(start.error());
  }
  const auto scales = coarse_scales(*start, bytes);
  if (!scales) return tl::unexpected(scales.error());
  const auto next =
      std::find_if(scales->begin(), scales->end(), [&](const CoarseScales& s) { return held == nullptr || s.finest < finest_scale(*held); });
  if (next == scales->end()) return nullptr;
  const auto first = file.read(0, next->first_bytes);
  if (!first) return tl::unexpected(first.error());
  const auto last = file.read(bytes - next->last_bytes, next->last_bytes);
  if (!last) return tl::unexpected(last.error());
  auto volume = decode_coarse({*first, *last, bytes}, *next, path.stem().string(), parallel);
  if (!volume) return tl::unexpected(volume.error());
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

}  // namespace intervale
