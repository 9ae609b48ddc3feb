#include "common/api/describe_data_set.h"

namespace intervale {

DataSetInfo info_of(const Description& d) {
  DataSetInfo info{.name = d.name,
                   .grid = d.grid,
                   .labels = d.labels,
                   .shown = {},
                   .values = {d.format.least(), d.format.greatest()},
                   .max_error = d.max_error,
                   .updates = d.updates,
                   .tets = d.has_every_range ? 0 : d.full.tets,
                   .channels = {}};
  if (!d.has_every_range) info.shown = d.whole();
  for (const Channel& channel : d.channels) info.channels.push_back({channel.name, channel.unit, unsigned(channel.components.size())});
  return info;
}

}  // namespace intervale
