#include <fmt/core.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/commands.h"
#include "client/net/http_get.h"
#include "client/program/access_options.h"
#include "common/util/printable.h"

namespace intervale {
namespace {

struct ListOptions {
  std::string url;
  Access access;
  bool json = false;
};

constexpr int kMaxDepth = 16;

// Drops what is nested deeper than any answer of our server: printing it would recurse once for each level.
bool is_shallow(int depth, nlohmann::ordered_json::parse_event_t /*event*/, const nlohmann::ordered_json& /*value*/) { return depth < kMaxDepth; }

// The text goes to a terminal: no control characters of the server's.
std::string shown(const nlohmann::ordered_json& value) { return printable(value.is_string() ? value.get<std::string>() : value.dump()); }

std::string line_of(const nlohmann::ordered_json& dataset) {
  const auto& dims = dataset.at("dims");
  const std::string name =
      fmt::format("{}: {} x {} x {} samples", shown(dataset.at("name")), shown(dims.at(0)), shown(dims.at(1)), shown(dims.at(2)));
  if (dataset.at("scope") == "every") {
    const auto& values = dataset.at("values");
    return fmt::format("{}, every range, values {:g} to {:g}, {} updates\n", name, values.at("least").get<double>(),
                       values.at("greatest").get<double>(), shown(dataset.at("updates")));
  }
  const auto& range = dataset.at("range");
  return fmt::format("{}, range [{:g}, {:g}], {} updates, {} tetrahedra in full\n", name, range.at(0).get<double>(), range.at(1).get<double>(),
                     shown(dataset.at("updates")), shown(dataset.at("full").at("tets")));
}

Result<void> list(const ListOptions& options) {
  const auto url = parse_url(options.url, options.access);
  if (!url) return tl::unexpected(url.error());
  if (!url->name.empty()) return misuse("list expects a server without the name of a data set: " + url->server());
  const auto body = http_get(*url, "/api/datasets");
  if (!body) return tl::unexpected(with_access_hint(body.error(), *url));
  // The parser throws on invalid JSON, and at() on JSON of another shape. Both are bad input from outside.
  try {
    const auto answer = nlohmann::ordered_json::parse(*body, &is_shallow);
    if (options.json) return print_json(answer);
    std::string text;
    for (const auto& dataset : answer.at("datasets")) text += line_of(dataset);
    return print(text.empty() ? "no data sets\n" : text);
  } catch (const nlohmann::json::exception&) {
    return fail(url->authority() + " is not an intervale server of this version: its list of data sets is invalid");
  }
}

}  // namespace

void add_list_command(Program& program) {
  const auto options = std::make_shared<ListOptions>();
  CLI::App& command = program.add_command("list", "List the data sets of a server", [options] { return list(*options); });
  command.add_option("URL", options->url, "ws://host:port, or wss://")->required();
  add_access_options(command, options->access);
  add_json_flag(command, options->json);
}

}  // namespace intervale
