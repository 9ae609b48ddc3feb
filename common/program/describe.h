// A description as JSON: the keys that `build --json`, `info --json` and /api/datasets share.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "common/patch/description.h"

namespace intervale {

// name dims spacing origin range refine max_error updates coefficients full{vertices tets indexed_bytes}. An end of the range that is
// infinite is the string "-inf" or "inf", for JSON has no such number.
[[nodiscard]] nlohmann::ordered_json to_json(const Description& description);

}  // namespace intervale
