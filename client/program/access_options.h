// The options for access to a server, the same for all client programs.
#pragma once

#include "client/net/url.h"
#include "common/program/program.h"

namespace intervale {

// --token (INTERVALE_TOKEN) and --ca (INTERVALE_CA). `access` must outlive the parsing.
void add_access_options(CLI::App& app, Access& access);

// An error of a connection to `url`, for the user of these options: where a token is missing, it says how to give one.
// The libraries' errors name no options.
[[nodiscard]] Error with_access_hint(Error error, const ServerUrl& url);

}  // namespace intervale
