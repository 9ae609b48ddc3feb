// The options for access to a server, the same for all client programs.
#pragma once

#include "client/net/url.h"
#include "common/program/program.h"

namespace intervale {

// --token (INTERVALE_TOKEN) and --ca (INTERVALE_CA). `access` must outlive the parsing.
void add_access_options(CLI::App& app, Access& access);

}  // namespace intervale
