// What `intervale build` reads, in one process or on several ranks: the field, and channels on its grid.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/diamond/grid.h"
#include "common/util/result.h"
#include "server/cli/build_options.h"
#include "server/resume/fingerprint.h"
#include "server/volume/raw_reader.h"
#include "server/volume/volume_reader.h"

namespace intervale {

// What can be told before anything is read: labels, the folder of the output, and that it is none of the inputs.
[[nodiscard]] Result<void> check_paths(const BuildCommand& options, const std::vector<ChannelInput>& channels);

// With one number a sample; misuse for vectors.
[[nodiscard]] Result<std::unique_ptr<VolumeReader>> open_field(const BuildCommand& options, const std::optional<RawLayout>& layout);

// The dims of the field before it is cropped, which are those of the channels' files; nothing if they need not be
// known.
[[nodiscard]] std::optional<Grid> whole_grid(const BuildCommand& options);
// Fails if the file says that it has other dims than `whole`.
[[nodiscard]] Result<std::unique_ptr<VolumeReader>> open_channel(const BuildCommand& options, const ChannelInput& input,
                                                                 const std::optional<Grid>& whole);

// Of the options and all files that are read. ours: files in their folders that the build writes.
[[nodiscard]] Result<Fingerprint> fingerprint_of(const BuildCommand& options, const std::vector<ChannelInput>& channels,
                                                 std::span<const std::filesystem::path> ours);

}  // namespace intervale
