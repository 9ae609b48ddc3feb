// `intervale serve`: runs a server with the given files and options until a signal ends it.
#pragma once

#include <filesystem>
#include <vector>

#include "common/util/result.h"
#include "server/serve/log.h"
#include "server/serve/options.h"
#include "server/serve/remote_data_sets.h"

namespace intervale {

// Serves the given .ivm files, the .ivm files in the given folders, and those at the given URLs, as CatalogueWatcher loads
// them, and follows changes in the folders and at the URLs. Blocks until SIGTERM or SIGINT, which are heard at once also
// while files are read; then drains and returns. A second one ends the process. Logs to stderr. SIGHUP sets the log level
// that the configuration file has now; if it has none, SIGHUP switches between debug and the level of the start. Failures:
// an address that is malformed or cannot be bound, a file that cannot be served. If the options name no viewer, the server
// uses ../share/intervale/viewer, relative to the program's folder, if that exists.
Result<void> serve(const ServeOptions& options, const LogOptions& log, const std::vector<std::filesystem::path>& inputs, RemoteInputs remote = {});

}  // namespace intervale
