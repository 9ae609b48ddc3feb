#include "server/cli/build_input.h"

#include <algorithm>
#include <string>

#include "server/builder/channel_builder.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"

namespace intervale {

Result<void> check_paths(const BuildCommand& options, const std::vector<ChannelInput>& channels) {
  Labels labels;
  if (auto valid = set_labels(options, labels); !valid) return valid;
  const std::filesystem::path folder = std::filesystem::absolute(options.output).parent_path();
  if (!std::filesystem::is_directory(folder))
    return fail("cannot write '" + options.output + "': the folder '" + folder.string() + "' does not exist");
  if (auto output = check_output(named_volume(options.input, options.part).path, options.output); !output) return output;
  for (const ChannelInput& channel : channels) {
    if (auto output = check_output(named_volume(channel.file.string()).path, options.output); !output) return output;
  }
  return {};
}

Result<std::unique_ptr<VolumeReader>> open_field(const BuildCommand& options, const std::optional<RawLayout>& layout) {
  const NamedVolume input = named_volume(options.input, options.part);
  auto reader = open_volume(input.path, layout, options.time_point, input.part);
  if (reader && (*reader)->header().components != 1 && !(*reader)->header().component)
    return misuse("'" + options.input + "' has vectors: choose a component with --part 0, 1 or 2; --channel reads all of it");
  return reader;
}

std::optional<Grid> whole_grid(const BuildCommand& options) {
  if (!options.dims.empty()) {
    Grid grid;
    std::copy_n(options.dims.begin(), 3, grid.dims.begin());
    return grid;
  }
  if (options.crop.empty()) return {};
  const NamedVolume field = named_volume(options.input, options.part);
  const auto header = read_volume_header(field.path, field.part);
  if (!header || !*header) return {};
  return (*header)->grid;
}

Result<std::unique_ptr<VolumeReader>> open_channel(const BuildCommand& options, const ChannelInput& input, const std::optional<Grid>& whole) {
  NamedVolume named = named_volume(input.file.string());
  const auto header = read_volume_header(named.path, named.part);
  const bool is_known = header && *header;
  const bool has_several = is_known && (*header)->time_points > 1 && !(*header)->time_point, has_parts = is_known && !(*header)->parts.empty();
  if (has_parts && !named.part) named.part = options.part;
  if (whole && is_known) {
    if (auto same = check_channel_grid(input.name, (*header)->grid, *whole); !same) return tl::unexpected(same.error());
  }
  return open_volume(named.path, {}, has_several ? options.time_point : std::nullopt, named.part);
}

Result<Fingerprint> fingerprint_of(const BuildCommand& options, const std::vector<ChannelInput>& channels,
                                   std::span<const std::filesystem::path> ours) {
  Fingerprint fingerprint;
  add_to(fingerprint, options);
  const NamedVolume input = named_volume(options.input, options.part);
  fingerprint.add(input.part);
  if (auto ok = fingerprint.add_input(input.path, ours); !ok) return tl::unexpected(ok.error());
  for (const ChannelInput& channel : channels) {
    const NamedVolume named = named_volume(channel.file.string());
    fingerprint.add(channel.name);
    fingerprint.add(channel.step);
    fingerprint.add(named.part);
    if (auto ok = fingerprint.add_input(named.path, ours); !ok) return tl::unexpected(ok.error());
  }
  return fingerprint;
}

}  // namespace intervale
