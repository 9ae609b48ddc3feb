// The option that names channels, the same for every program that makes meshes.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace intervale {

// Adds --channel, which may be repeated. channels must outlive app.
void add_channel_option(CLI::App& app, std::vector<std::string>& channels);

}  // namespace intervale
