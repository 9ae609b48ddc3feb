#include "server/api/build.h"

#include <cstddef>
#include <utility>

#include "common/api/data_set_holder.h"
#include "server/builder/build_data_set.h"
#include "server/volume/read_volume.h"

namespace intervale {
namespace {

Result<BuiltChannels> build_channels(DataSetOptions& options, const Grid& grid, const SupercubeSet& set) {
  BuiltChannels built;
  for (ChannelVolume& channel : options.channels) {
    if (auto added = add_channel(built, channel.volume, channel.name, channel.step, options.nan, grid, set); !added)
      return tl::unexpected(added.error());
    channel.volume.bytes = std::vector<std::byte>();
  }
  if (auto valid = check_channels(built.channels); !valid) return tl::unexpected(valid.error());
  return built;
}

Result<void> check_samples(Volume& volume, const DataSetOptions& options) {
  if (auto valid = check_grid(volume.grid); !valid) return valid;
  const auto matches = [](const Volume& v) { return v.bytes.size() == v.grid.sample_count() * v.components * size_of(v.type); };
  if (!matches(volume)) return misuse("the volume's bytes are not as many as its samples need");
  if (volume.components != 1) return misuse("the volume has vectors: a field has one number a sample; vectors can be channels");
  if (options.range && !(options.range->alpha <= options.range->beta)) return misuse("the range must be LO <= HI");
  if (!options.range && options.refine != Refine::boundary) return misuse("what to refine is said with a range; every range has all");
  if (options.channels.size() > kMaxChannels) return misuse("at most " + std::to_string(kMaxChannels) + " channels");
  for (const ChannelVolume& channel : options.channels) {
    if (auto valid = check_grid(channel.volume.grid); !valid) return valid;
    if (!matches(channel.volume)) return misuse("the channel's bytes are not as many as its samples need");
    if (channel.volume.components != 1 && channel.volume.components != kMaxComponents) return misuse("a channel has 1 or 3 numbers a sample");
  }
  if (auto valid = check_labels(volume.labels); !valid) return valid;
  return check_finite(volume, options.nan);
}

Result<DataSet> build_one_range(Volume& volume, DataSetOptions& options) {
  auto parts = build_range(volume, {*options.range, options.refine, options.progress}, options.step);
  if (!parts) return tl::unexpected(parts.error());
  auto made = IntervalVolume::assemble(std::move(*parts));
  if (!made) return tl::unexpected(made.error());
  auto built = build_channels(options, volume.grid, made->set());
  if (!built) return tl::unexpected(built.error());
  if (auto set = made->set_channels(std::move(built->channels), std::move(built->keys)); !set) return tl::unexpected(set.error());
  return DataSet(hold(std::move(*made)));
}

Result<DataSet> build_all_ranges(Volume& volume, DataSetOptions& options) {
  auto parts = build_every_range(volume, options.step, options.progress);
  if (!parts) return tl::unexpected(parts.error());
  auto built = build_channels(options, volume.grid, parts->set);
  if (!built) return tl::unexpected(built.error());
  parts->description.channels = std::move(built->channels);
  parts->channel_keys = std::move(built->keys);
  return DataSet(hold(ValueVolume(std::move(*parts))));
}

}  // namespace

Result<DataSet> build_data_set(Volume volume, DataSetOptions options) {
  if (auto valid = check_samples(volume, options); !valid) return tl::unexpected(valid.error());
  return options.range ? build_one_range(volume, options) : build_all_ranges(volume, options);
}

}  // namespace intervale
