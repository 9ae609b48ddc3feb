#include "server/builder/channel_builder.h"

#include <utility>

#include "common/ivm/paged_values.h"
#include "common/ivm/value_page.h"
#include "common/parallel/all_cores.h"
#include "server/builder/find_keys.h"
#include "server/builder/value_steps.h"
#include "server/volume/read_volume.h"

namespace intervale {

Result<BuiltChannel> build_channel(const Volume& volume, std::string name, std::optional<double> step, const SupercubeSet& set) {
  BuiltChannel built{{std::move(name), volume.labels.field_unit, {}}, {}};
  for (unsigned c = 0; c < volume.components; ++c) {
    const Volume samples = component_of(volume, c);
    const auto format = choose_value_format(samples, step);
    if (!format) return tl::unexpected(format.error());
    if (format->table) return misuse("the values of channel '" + built.channel.name + "' have no exact step: give another one with --channel-step");
    ChannelComponent component{*format, has_exact_values(samples, *format), corner_keys(samples, *format), {}};
    ValueKeys& keys = built.keys.emplace_back(set.size(), format->last);
    find_keys(samples, *format, set, keys);
    component.weights = fit_weights({samples.grid, set, component, keys}, on_all_cores);
    built.channel.components.push_back(std::move(component));
  }
  return built;
}

}  // namespace intervale
