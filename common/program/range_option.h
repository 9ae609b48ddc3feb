// The option --range LO HI, common to all programs.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/patch/description.h"
#include "common/util/result.h"

namespace intervale {

// Of programs that show a range of a data set.
inline constexpr const char* kShownRangeHelp =
    "Closed range of values: numbers, -inf or inf; needed if the data set has every range. Up to four times: a mesh for each range";
inline constexpr const char* kShownRefineHelp =
    "With --range, what to refine: boundary (default): the surfaces of the range only; uniform: the inside too";

// Adds --range LO HI. bounds: stays empty if the option is not given; must outlive app.
CLI::Option* add_range_option(CLI::App& app, std::vector<std::string>& bounds, const std::string& help);

// The closed range that the bounds say; nothing if there are none. Misuse: a bound that is no number, -inf or inf; LO
// greater than HI; and ranges without a finite number.
[[nodiscard]] Result<std::optional<Range>> parse_range(const std::vector<std::string>& bounds);

// The same for programs that show several ranges: the option may be repeated, and bounds gets those of one after the
// other.
CLI::Option* add_ranges_option(CLI::App& app, std::vector<std::string>& bounds, const std::string& help);
// All of them, in their order; misuse as for one, and more than kMaxRanges.
[[nodiscard]] Result<std::vector<Range>> parse_ranges(const std::vector<std::string>& bounds);

// Adds --refine boundary|uniform. refine: stays empty if the option is not given; must outlive app.
CLI::Option* add_refine_option(CLI::App& app, std::optional<std::string>& refine, const std::string& help);
[[nodiscard]] std::optional<Refine> parse_refine(const std::optional<std::string>& refine);

}  // namespace intervale
