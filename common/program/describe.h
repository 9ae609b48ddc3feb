// A description as JSON: the keys common to `build --json`, `info --json` and /api/datasets.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>

#include "common/patch/description.h"

namespace intervale {

// name scope dims spacing origin affine unit field field_unit channels range refine values{least greatest} step
// max_error updates coefficients full{vertices tets indexed_bytes}. scope is "one": the updates are those of one range.
// values: of the field. step: how far the kept values are apart; 0 if they are exact. Infinite ends of the range are
// the strings "-inf" and "inf", since JSON has no such numbers.
[[nodiscard]] nlohmann::ordered_json to_json(const Description& description);

// For each channel: name, kind ("scalar" or "vector"), unit, values{least greatest} (of a vector: of lengths, and no
// vector is longer), step of each component (0 if it is exact).
[[nodiscard]] nlohmann::ordered_json to_json(std::span<const Channel> channels);

// The ends of a range, as above.
[[nodiscard]] nlohmann::ordered_json to_json(const Range& range);

// Adds dims, spacing (lengths of the affine's columns), origin (its last column), affine (12 numbers, row by row) and
// the labels unit, field, field_unit and space.
void add_grid(nlohmann::ordered_json& json, const Grid& grid, const Labels& labels);

}  // namespace intervale
