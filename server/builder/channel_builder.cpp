#include "server/builder/channel_builder.h"

#include <utility>

#include "common/ivm/paged_values.h"
#include "common/ivm/value_page.h"
#include "common/parallel/all_cores.h"
#include "common/util/printable.h"
#include "server/builder/find_keys.h"
#include "server/builder/value_steps.h"
#include "server/volume/read_volume.h"

namespace intervale {

Result<BuiltChannel> build_channel(const Volume& volume, std::string name, std::optional<double> step, const SupercubeSet& set) {
  BuiltChannel built{{std::move(name), volume.labels.field_unit, {}}, {}};
  for (unsigned c = 0; c < volume.components; ++c) {
    const Volume samples = component_of(volume, c);
    const auto format = channel_format(choose_value_format(samples, step));
    if (!format) return tl::unexpected(format.error());
    ChannelComponent component{*format, has_exact_values(samples, *format), corner_keys(samples, *format), {}};
    ValueKeys& keys = built.keys.emplace_back(set.size(), format->last);
    find_keys(samples, *format, set, keys);
    component.weights = fit_weights({samples.grid, set, component, keys}, on_all_cores);
    built.channel.components.push_back(std::move(component));
  }
  return built;
}

Result<ValueFormat> channel_format(Result<ValueFormat> chosen) {
  if (chosen && chosen->table) return misuse("its values have no exact step: give another one with --channel-step");
  return chosen;
}

Result<void> check_channel_grid(const std::string& name, const Grid& grid, const Grid& field) {
  const auto text = [](const Grid& g) { return std::to_string(g.dims[0]) + " x " + std::to_string(g.dims[1]) + " x " + std::to_string(g.dims[2]); };
  if (grid.dims == field.dims) return {};
  return fail("channel '" + printable(name) + "' has " + text(grid) + " samples, the field has " + text(field));
}

tl::unexpected<Error> of_channel(const std::string& name, const Error& error) {
  return tl::unexpected(Error{"channel '" + printable(name) + "': " + error.message, error.usage});
}

}  // namespace intervale
