#include "server/builder/build_data_set.h"

#include <utility>

#include "server/builder/channel_builder.h"
#include "server/builder/find_keys.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "server/volume/read_volume.h"

namespace intervale {
namespace {

// The compression, which follows, takes memory of its own.
void free_samples(Volume& volume) { volume.bytes = std::vector<std::byte>(); }

}  // namespace

Result<IntervalVolume::Parts> build_range(Volume& volume, const BuildOptions& options, std::optional<double> step) {
  const auto format = choose_value_format(volume, step);
  if (!format) return tl::unexpected(format.error());
  const bool is_exact = has_exact_values(volume, *format);
  round_samples(volume, *format);
  Result<IntervalVolume::Parts> made = FieldHierarchy(volume, options).parts(*format, is_exact);
  free_samples(volume);
  return made;
}

Result<ValueVolume::Parts> build_every_range(Volume& volume, std::optional<double> step, const std::function<void(double)>& progress,
                                             KeptErrors* kept) {
  if (volume.grid.sample_count() > kMostSamples) return misuse("the volume has more than 2^36 samples, too many for every range: give --range LO HI");
  const auto format = choose_value_format(volume, step);
  if (!format) return tl::unexpected(format.error());
  ValueVolume::Parts parts = build_value_volume(volume, *format, progress, kept).take();
  free_samples(volume);
  return parts;
}

Result<void> add_channel(BuiltChannels& built, Volume& volume, const std::string& name, std::optional<double> step, std::optional<double> nan,
                         const Grid& grid, const SupercubeSet& set) {
  if (auto same = check_channel_grid(name, volume.grid, grid); !same) return same;
  if (auto finite = check_finite(volume, nan); !finite) return finite;
  auto channel = build_channel(volume, name, step, set);
  if (!channel) return of_channel(name, channel.error());
  built.channels.push_back(std::move(channel->channel));
  built.keys.push_back(std::move(channel->keys));
  return {};
}

}  // namespace intervale
