// The coarse scales of a data set of every range, read before the rest of its file is there.
//
// Pages lie in the file from coarse to fine, and none needs a finer one (FORMAT.md). So the beginning of a file, and the
// few kilobytes after its pages, are the data set as far as to some scale: each scale more takes about eight times as
// much. Errors and descriptions are those of the whole data set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/ivm/ivm_container.h"
#include "common/util/parallel.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

// What is needed of a file for the scale `finest` and all coarser ones: its first and its last bytes.
struct CoarseScales {
  int finest = 0;
  std::uint64_t first_bytes = 0, last_bytes = 0;
};

// The first bytes of a file that coarse_scales() needs to have of all but the largest.
inline constexpr std::size_t kStartBytes = 64 << 10;
// How many it needs, if `start` are kStartBytes or all: up to the end of the index of the pages, some 16 bytes for each page
// of 262,144 diamonds. No more than `start` has where it will find none, or the index is too long to be one.
[[nodiscard]] std::uint64_t start_bytes(std::span<const std::byte> start, std::uint64_t file_bytes);

// What can be had of a file before all of it, from the coarsest on: the scales of the first page, and then each further one
// but the finest. None of a data set of one range, one with channels, one that is a single page, and where `start` ends
// within the index of the pages. start: the file's first bytes, start_bytes() or all. Fails if they begin no .ivm file of so
// many bytes.
[[nodiscard]] Result<std::vector<CoarseScales>> coarse_scales(std::span<const std::byte> start, std::uint64_t file_bytes);

// These scales, with as many bytes at both ends as they need: as of_every_range() makes them, but not whole
// (IntervalVolume::is_whole()). Fails as decode_volume().
[[nodiscard]] Result<IntervalVolume> decode_coarse(const FileEnds& file, const CoarseScales& scales, std::string name,
                                                   const ParallelFor& parallel = serial);

// Whether a level of detail needs more of a data set than these coarse scales of it, whichever ranges are shown. False of one
// that is whole.
[[nodiscard]] bool wants_finer(const IntervalVolume& volume, const Lod& lod);

// The same where it need not be measured how far surfaces move: an update is taken to move them by half its diamond's
// width at most (FORMAT.md, "From errors to distances": all but those that are far). So a camera wants no scale of
// whose diamonds half the width is within its pixel error at the nearest point of the box.
[[nodiscard]] bool estimates_want_finer(const IntervalVolume& volume, const Lod& lod);

// The coarsest of these of a file that are finer than what is held of it, by its first and last bytes. held: nullptr for
// nothing. nullptr: there are none, and the file is to be read whole. The name is the file's.
[[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> load_coarse_volume(const std::filesystem::path& path,
                                                                               const IntervalVolume* held = nullptr,
                                                                               const ParallelFor& parallel = serial);

}  // namespace intervale
