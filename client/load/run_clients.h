// The clients of a load on one thread. LoadViews explains what is measured, and how.
#pragma once

#include <optional>
#include <span>

#include "client/load/load_plan.h"
#include "client/load/load_stats.h"
#include "client/load/verify_meshes.h"

namespace intervale {

// Runs clients number `first`, `first + step`, … of the plan on this thread until the last one has closed, at most
// the plan's grace and patience after its end. meshes: a place for each of the plan's clients, filled if
// the plan says verify, left empty if a batch was invalid; other threads may fill other places meanwhile. Throws on
// failures of the machine, and if the host is not found.
[[nodiscard]] LoadStats run_clients(const LoadPlan& plan, unsigned first, unsigned step, std::span<std::optional<LoadedMesh>> meshes,
                                    LoadProgress& progress);

}  // namespace intervale
