// The options of a level of detail, the same for every program that takes one.
#pragma once

#include <cstdint>
#include <optional>

#include <CLI/CLI.hpp>

#include "common/view/lod.h"

namespace intervale {

// Adds --error, --error-percent, --roi, those of a camera from --eye to --pixel-error, --max-tets and --max-updates, which fill lod when the
// arguments are read. Afterwards every number is finite, the error is at least 0, the percentage within 0 to 100, not both are given, and the box is
// in order: what is not so is wrong usage. The camera is for check_lod to check. lod must outlive app.
void add_lod_options(CLI::App& app, Lod& lod);

// --max-bytes: for programs that receive updates.
void add_max_bytes_option(CLI::App& app, std::optional<std::uint64_t>& max_bytes);

}  // namespace intervale
