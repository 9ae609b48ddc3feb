// A whole load run: from a URL and options to stats.
#pragma once

#include "client/load/load_plan.h"
#include "client/load/load_stats.h"
#include "client/net/url.h"
#include "common/util/result.h"

namespace intervale {

// Asks the server for the description, runs the clients, and compares meshes. Blocks for the duration and up to the grace
// and the patience; to compare meshes of a range each, also for two streams for each client. Fails if the run is not
// possible: no server, no such data set, a range or scenario that the data set is not for (misuse), too few open files
// allowed; and if those streams cannot be had. Clients that fail later and meshes that differ are in the report.
[[nodiscard]] Result<LoadReport> run_load(const ServerUrl& url, const LoadOptions& options);

}  // namespace intervale
