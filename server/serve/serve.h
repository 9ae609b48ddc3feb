// `intervale serve`: from files and options to a server that runs until it is told to stop.
#pragma once

#include <filesystem>
#include <vector>

#include "common/util/result.h"
#include "server/serve/log.h"
#include "server/serve/options.h"

namespace intervale {

// Serves the .ivm files given, and those in the folders given (a damaged file in a folder is logged and left out; one that is named is an
// error, like two data sets of one name), and takes up what appears in these folders, changes and goes. Blocks until SIGTERM or SIGINT, then drains
// and returns. Logs on stderr. SIGHUP changes the log's level: to what the configuration file says now, or if that says nothing, to debug and back.
// Failures: an address that cannot be read or had, a file that cannot be served. Where the options name no viewer, the one beside the program is
// served, if there is one:
// ../share/intervale/viewer from its folder.
Result<void> serve(const ServeOptions& options, const LogOptions& log, const std::vector<std::filesystem::path>& inputs);

}  // namespace intervale
