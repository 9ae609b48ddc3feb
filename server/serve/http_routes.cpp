#include "server/serve/http_routes.h"

#include <nlohmann/json.hpp>

#include "common/program/describe.h"

namespace intervale {
namespace {

constexpr const char* kHtml = "text/html; charset=utf-8";
constexpr const char* kJson = "application/json";
constexpr const char* kPrometheus = "text/plain; version=0.0.4; charset=utf-8";

std::string escaped(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

std::string datasets_json(const Catalogue& catalogue) {
  auto datasets = nlohmann::ordered_json::array();
  for (const auto& [name, volume] : catalogue.volumes()) datasets.push_back(to_json(volume->description()));
  return nlohmann::ordered_json{{"datasets", std::move(datasets)}}.dump() + "\n";
}

std::string front_page(const Catalogue& catalogue) {
  std::string page =
      "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Intervale</title>\n<h1>Intervale</h1>\n"
      "<p>This server streams interval volumes: tetrahedral meshes of the part of a volume whose values lie in a range, coarse first and refined as "
      "far as you ask. Fetch one with <code>intervale-client fetch ws://HOST:PORT/NAME -o mesh.vtu</code>.</p>\n<ul>\n";
  for (const auto& [name, volume] : catalogue.volumes()) {
    const Description& d = volume->description();
    page += "<li>" + escaped(name) + ": " + std::to_string(d.grid.dims[0]) + " × " + std::to_string(d.grid.dims[1]) + " × " +
            std::to_string(d.grid.dims[2]) + " samples, " + std::to_string(d.updates) + " updates, " + std::to_string(d.full.tets) +
            " tetrahedra in full</li>\n";
  }
  return page + "</ul>\n<p><a href=\"/api/datasets\">As JSON</a></p>\n</html>\n";
}

}  // namespace

HttpAnswer answer(std::string_view method, std::string_view target, const HttpState& state) {
  const std::string_view path = target.substr(0, target.find('?'));
  const bool known = path == "/" || path == "/api/datasets" || path == "/healthz" || path == "/readyz" || path == "/metrics";
  if (!known) return {.status = 404, .body = "nothing here\n"};
  if (method != "GET" && method != "HEAD") return {.status = 405, .body = "only GET and HEAD\n"};
  if (path == "/") return {.content_type = kHtml, .body = front_page(state.catalogue)};
  if (path == "/api/datasets") return {.content_type = kJson, .body = datasets_json(state.catalogue)};
  if (path == "/metrics") return {.content_type = kPrometheus, .body = state.metrics.text()};
  if (path == "/readyz" && !state.ready) return {.status = 503, .body = "draining\n"};
  return {.body = "ok\n"};
}

}  // namespace intervale
