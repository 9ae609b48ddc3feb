// The clients of a load: see LoadViews for what of them is measured, and how.
#pragma once

#include <optional>
#include <span>

#include "client/core/stream_client.h"
#include "client/load/load_plan.h"
#include "client/load/load_stats.h"

namespace intervale {

// Runs clients number `first`, `first + step`, … of the plan on this thread, until the last has closed: at most kGrace and the plan's patience after
// its end. meshes: a place for each of the plan's clients, filled if the plan says verify, left empty where a batch did not apply; other threads may
// fill other places meanwhile. Throws where the machine fails, the host cannot be found for one.
[[nodiscard]] LoadStats run_clients(const LoadPlan& plan, unsigned first, unsigned step, std::span<std::optional<StreamClient>> meshes,
                                    LoadProgress& progress);

}  // namespace intervale
