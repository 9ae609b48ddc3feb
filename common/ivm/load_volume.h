// Data sets of one range or of every range (.ivm), as what meshes are extracted and streamed from.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/page_faults.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// The bytes of an .ivm file, for decode_volume. Checks the header and the length first, and allocates nothing for another
// file. Errors begin with the path. `parallel` may stop this, as all that follows, within milliseconds.
[[nodiscard]] Result<std::vector<std::byte>> read_volume_file(const std::filesystem::path& path, const ParallelFor& parallel = serial);

// A data set from outside: as decode_ivm() or decode_values() checks it. One of every range is as of_every_range() makes
// it. room, faults: as of decode_ivm().
[[nodiscard]] Result<IntervalVolume> decode_volume(std::span<const std::byte> bytes, std::string name, const ParallelFor& parallel = serial,
                                                   std::uint64_t room = kAnyRoom, PageFaults* faults = nullptr);

// What some ranges need of a data set of every range: as decode_needed_values() has it (value_file.h). Not for other ranges.
[[nodiscard]] Result<IntervalVolume> decode_needed_volume(const FileEnds& file, std::string name, const std::vector<bool>& pages,
                                                          const ParallelFor& parallel = serial);

// Both. The name is the file's, without folders and extension. Errors begin with the path.
[[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> load_volume(const std::filesystem::path& path, const ParallelFor& parallel = serial,
                                                                        PageFaults* faults = nullptr);

}  // namespace intervale
