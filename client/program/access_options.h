// The options that say how to be let in, the same for every program that talks to a server.
#pragma once

#include "client/net/url.h"
#include "common/program/program.h"

namespace intervale {

// --token (INTERVALE_TOKEN) and --ca (INTERVALE_CA). `access` must live until the options are read.
void add_access_options(CLI::App& app, Access& access);

}  // namespace intervale
