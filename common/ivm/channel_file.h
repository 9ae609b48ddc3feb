// The channels of an .ivm file: two streams that a reader may skip. FORMAT.md is the specification.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/kept_pages.h"
#include "common/ivm/page_faults.h"
#include "common/ivm/value_keys.h"
#include "common/patch/channel.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// Appends channels, if there are any. grid, set: of the data set; keys: by channel, component and number in the set. The
// same bytes whatever `parallel` is, and whichever of their pages were kept; kept may be null.
void append_channels(Streams& streams, const Grid& grid, const SupercubeSet& set, const std::vector<Channel>& channels,
                     const std::vector<ChannelKeys>& keys, const ParallelFor& parallel, KeptPages* kept);

// The stream of channels, if there are any, whose pages are elsewhere. index: called for each component of each
// channel, in order; appends a record for each of its pages (value_streams.h).
using AppendIndex = std::function<void(std::vector<std::byte>& to, std::size_t channel, std::size_t component)>;
void append_channels(Streams& streams, const Grid& grid, const std::vector<Channel>& channels, const AppendIndex& index);

struct StoredChannels {
  std::vector<Channel> channels;
  std::vector<ChannelKeys> keys;
};
// The inverse, of bytes from outside; none if the file has none.
// faults: as of read_pages().
[[nodiscard]] Result<StoredChannels> read_channels(const Container& file, const Grid& grid, const SupercubeSet& set, const ParallelFor& parallel,
                                                   PageFaults* faults);

}  // namespace intervale
