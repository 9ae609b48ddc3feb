// The options of a picture, the same for every program that draws one.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/picture/picture.h"

namespace intervale {

// Adds --image, --render, --opacity, --clip, --edges, --color-by, --palette and --color-span, which fill `picture` when
// the arguments are parsed; without --image it stays empty, and the others are misuse. The values are checked by
// check_picture. picture must outlive app.
void add_picture_options(CLI::App& app, std::optional<PictureOptions>& picture);

// These channels, and that of the picture's colours if there is one.
[[nodiscard]] std::vector<std::string> with_channel_of(const std::optional<PictureOptions>& picture, std::vector<std::string> channels);

}  // namespace intervale
