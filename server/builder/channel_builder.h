// Channels (channel.h) of a data set, from volumes on its grid.
#pragma once

#include <optional>
#include <string>

#include "common/diamond/supercube.h"
#include "common/ivm/value_keys.h"
#include "common/patch/channel.h"
#include "common/patch/volume.h"
#include "common/util/result.h"

namespace intervale {

struct BuiltChannel {
  Channel channel;
  ChannelKeys keys;  // by component, and number in the set
};

// The values of a volume at the centres of a set's diamonds. volume: samples are finite; its dims are those of the set's
// grid. The unit is that of the volume's field. step: as for the field (choose_value_format()); misuse also where that
// calls for a table of values. Uses all cores that oneTBB may.
[[nodiscard]] Result<BuiltChannel> build_channel(const Volume& volume, std::string name, std::optional<double> step, const SupercubeSet& set);

// Passes on a format that was chosen for a channel; misuse if it has a table.
[[nodiscard]] Result<ValueFormat> channel_format(Result<ValueFormat> chosen);
// Fails if a channel does not have as many samples as the field.
[[nodiscard]] Result<void> check_channel_grid(const std::string& name, const Grid& grid, const Grid& field);
// An error that says of which channel it is.
[[nodiscard]] tl::unexpected<Error> of_channel(const std::string& name, const Error& error);

}  // namespace intervale
