// A description as JSON: the keys common to `build --json`, `info --json` and /api/datasets.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "common/patch/description.h"

namespace intervale {

// name dims spacing origin range refine max_error updates coefficients full{vertices tets indexed_bytes}. Infinite
// ends of the range are the strings "-inf" and "inf", since JSON has no such numbers.
[[nodiscard]] nlohmann::ordered_json to_json(const Description& description);

}  // namespace intervale
