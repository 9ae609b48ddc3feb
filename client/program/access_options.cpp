#include "client/program/access_options.h"

#include <algorithm>

namespace intervale {
namespace {

// It stands in a header: nothing in it may end that.
std::string no_token(const std::string& text) {
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
  return plain ? "" : "must be of visible ASCII characters";
}

}  // namespace

void add_access_options(CLI::App& app, Access& access) {
  const auto group = "Access";
  // Not checked by the parser, which would show it.
  app.add_option_function<std::string>(
         "--token",
         [&access](const std::string& token) {
           if (const std::string complaint = no_token(token); !complaint.empty()) throw CLI::ValidationError("--token", complaint);
           access.token = token;
         },
         "What the server knows you by, if it asks; better given in the environment, where other users do not see it")
      ->type_name("TOKEN")
      ->group(group);
  app.add_option_function<std::string>(
         "--ca", [&access](const std::string& file) { access.authorities = file; },
         "With wss://: certificates (PEM) to trust instead of the system's, such as the server's own")
      ->type_name("FILE")
      ->group(group);
}

}  // namespace intervale
