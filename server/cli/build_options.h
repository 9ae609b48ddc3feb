// The options of `intervale build`, and what they mean.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/patch/labels.h"
#include "common/patch/volume.h"
#include "common/util/result.h"
#include "server/resume/fingerprint.h"
#include "server/volume/raw_reader.h"

namespace intervale {

struct BuildCommand {
  std::string input, output;
  std::vector<std::string> range;
  std::string refine = "boundary", type;
  std::optional<double> nan, step;
  unsigned threads = 0;
  std::vector<std::int64_t> dims;
  std::vector<double> spacing, origin, affine;
  std::optional<std::string> unit, field, field_unit, space;
  std::vector<std::string> channels, channel_steps;  // NAME=FILE, NAME=S
  bool big_endian = false, resume = false, json = false;
  std::uint64_t skip = 0;
  std::optional<std::uint64_t> time_point;
  std::optional<std::string> part;
  std::vector<std::int64_t> crop;  // first and last on x, on y and on z
  std::optional<std::uint64_t> memory;
  std::optional<std::string> scratch;
};

// Adds all of them. options: must outlive the command.
void add_build_options(CLI::App& command, BuildCommand& options);

// A channel to be built.
struct ChannelInput {
  std::string name;
  std::filesystem::path file;
  std::optional<double> step;
};

// Misuse where options contradict each other or make no sense. Nothing: the input describes itself.
[[nodiscard]] Result<std::optional<RawLayout>> parse_layout(const BuildCommand& options);
[[nodiscard]] std::optional<SampleBox> crop_of(const BuildCommand& options);  // nothing: all samples
[[nodiscard]] Result<std::vector<ChannelInput>> parse_channels(const BuildCommand& options);
// What the options say instead of the input.
[[nodiscard]] Result<void> set_labels(const BuildCommand& options, Labels& labels);

// Protects the input, and files of other kinds, from being overwritten by mistake.
[[nodiscard]] Result<void> check_output(const std::filesystem::path& input, const std::filesystem::path& output);

// Adds the options that the bytes of the output depend on, but for the input and the channels.
void add_to(Fingerprint& fingerprint, const BuildCommand& options);

}  // namespace intervale
