#include "client/program/access_options.h"

#include <algorithm>

#include "client/net/connection.h"

namespace intervale {

void add_access_options(CLI::App& app, Access& access) {
  const auto group = "Access";
  // Not a check of the parser, whose error would show the token. The token is sent in a header: nothing in it may end
  // the header.
  app.add_option_function<std::string>(
         "--token",
         [&access](const std::string& token) {
           const bool is_visible = std::all_of(token.begin(), token.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
           if (token.empty() || !is_visible) throw CLI::ValidationError("--token", "must be of visible ASCII characters");
           access.token = token;
         },
         "Identifies you to a server that requires tokens. Better given as INTERVALE_TOKEN: other users can see arguments")
      ->type_name("TOKEN")
      ->group(group);
  app.add_option("--ca", access.authorities, "With wss://: PEM file of certificates to trust instead of the system's, such as the server's own")
      ->type_name("FILE")
      ->group(group);
}

Error with_access_hint(Error error, const ServerUrl& url) {
  if (!url.access.token && error.message == unauthorized(url).message) error.message += ": --token or INTERVALE_TOKEN";
  return error;
}

}  // namespace intervale
