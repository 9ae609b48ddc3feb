// The option --range LO HI, common to all programs.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/patch/description.h"
#include "common/util/result.h"

namespace intervale {

// Adds --range LO HI. bounds: stays empty if the option is not given; must outlive app.
CLI::Option* add_range_option(CLI::App& app, std::vector<std::string>& bounds, const std::string& help);

// The closed range that the bounds say; nothing if there are none. Misuse: a bound that is no number, -inf or inf; LO
// greater than HI; and ranges without a finite number.
[[nodiscard]] Result<std::optional<Range>> parse_range(const std::vector<std::string>& bounds);

}  // namespace intervale
