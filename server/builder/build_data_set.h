// From a volume to a data set of one range or of every range: the steps of building, in their order.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/ivm/value_volume.h"
#include "common/patch/volume.h"
#include "common/util/result.h"
#include "server/builder/field_hierarchy.h"

namespace intervale {

// Of one range, to be assembled. volume: its samples are finite; they are freed. step: as of choose_value_format().
[[nodiscard]] Result<IntervalVolume::Parts> build_range(Volume& volume, const BuildOptions& options, std::optional<double> step);

// Of every range, likewise; kept: as of BuildOptions. Misuse for more than kMostSamples samples.
[[nodiscard]] Result<ValueVolume::Parts> build_every_range(Volume& volume, std::optional<double> step, const std::function<void(double)>& progress,
                                                           KeptErrors* kept = nullptr);

// The channels of a data set, one after the other, so that the samples of one are in memory.
struct BuiltChannels {
  std::vector<Channel> channels;
  std::vector<ChannelKeys> keys;  // by channel
};
// volume: on `grid`, the field's, or it fails. nan: what replaces samples that are not finite; without it they are an error.
[[nodiscard]] Result<void> add_channel(BuiltChannels& built, Volume& volume, const std::string& name, std::optional<double> step,
                                       std::optional<double> nan, const Grid& grid, const SupercubeSet& set);

}  // namespace intervale
