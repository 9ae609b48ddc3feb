// The level-of-detail options, common to all programs.
#pragma once

#include <cstdint>
#include <optional>

#include <CLI/CLI.hpp>

#include "common/view/lod.h"

namespace intervale {

// Adds --error, --error-percent, --roi, the camera's options from --eye to --pixel-error, --max-tets and
// --max-updates, which set lod when the arguments are parsed. Wrong usage: a number that is not finite, a negative
// error, a percentage outside [0, 100], --error together with --error-percent, a box with min > max. check_lod()
// checks the camera. lod must outlive app.
void add_lod_options(CLI::App& app, Lod& lod);

// Adds --max-bytes, for programs that receive updates.
void add_max_bytes_option(CLI::App& app, std::optional<std::uint64_t>& max_bytes);

}  // namespace intervale
