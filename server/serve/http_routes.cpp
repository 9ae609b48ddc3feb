#include "server/serve/http_routes.h"

#include <algorithm>
#include <cctype>
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

std::string datasets_json(const Catalogue& catalogue, const Scope& scope) {
  auto datasets = nlohmann::ordered_json::array();
  for (const auto& [name, volume] : catalogue.volumes()) {
    if (scope.allows(name)) datasets.push_back(to_json(volume->description()));
  }
  return nlohmann::ordered_json{{"datasets", std::move(datasets)}}.dump() + "\n";
}

std::string front_page(const Catalogue& catalogue, const Scope* scope) {
  std::string page =
      "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Intervale</title>\n<h1>Intervale</h1>\n"
      "<p>This server streams interval volumes: tetrahedral meshes of the part of a volume whose values lie in a range, coarse first and refined as "
      "far as you ask. Fetch one with <code>intervale-client fetch ws://HOST:PORT/NAME -o mesh.vtu</code>.</p>\n<ul>\n";
  for (const auto& [name, volume] : catalogue.volumes()) {
    if (scope == nullptr || !scope->allows(name)) continue;
    const Description& d = volume->description();
    page += "<li>" + escaped(name) + ": " + std::to_string(d.grid.dims[0]) + " × " + std::to_string(d.grid.dims[1]) + " × " +
            std::to_string(d.grid.dims[2]) + " samples, " + std::to_string(d.updates) + " updates, " + std::to_string(d.full.tets) +
            " tetrahedra in full</li>\n";
  }
  return page + "</ul>\n<p><a href=\"/api/datasets\">As JSON</a>. There is no viewer here: see <code>--viewer</code>.</p>\n</html>\n";
}

HttpAnswer with_body(const char* content_type, std::string body) {
  return {.content_type = content_type, .body = std::make_shared<const std::string>(std::move(body))};
}

// Where a page may open WebSockets. 'self' does not cover them in every browser, so the host that was asked is named; hosts of other characters
// than a policy can hold (addresses in brackets) leave every host.
std::string websockets_of(std::string_view host) {
  const bool plain = !host.empty() &&
                     std::all_of(host.begin(), host.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '.' || c == '-' || c == ':'; });
  if (!plain) return "ws: wss:";
  return "ws://" + std::string(host) + " wss://" + std::string(host);
}

std::string viewer_policy(std::string_view host) {
  return "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' " +
         websockets_of(host) +
         "; worker-src 'self'; manifest-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";
}

HttpAnswer file_answer(const HttpRequest& request, const StaticFile& file) {
  const bool packed = file.gzip && accepts_gzip(request.accept_encoding);
  const StaticContent& content = packed ? *file.gzip : file.plain;
  HttpAnswer answer{.content_type = file.content_type, .body = content.bytes, .content_security_policy = viewer_policy(request.host)};
  answer.cache_control = file.immutable ? "public, max-age=31536000, immutable" : "no-cache";
  answer.headers = {{"ETag", content.etag}};
  if (file.gzip) answer.headers.emplace_back("Vary", "Accept-Encoding");
  if (names_etag(request.if_none_match, content.etag)) {
    answer.status = 304;
    answer.body = nullptr;
  } else if (packed) {
    answer.headers.emplace_back("Content-Encoding", "gzip");
  }
  return answer;
}

// Lets pages of allowed origins read an answer.
HttpAnswer shared(const HttpRequest& request, HttpAnswer answer) {
  answer.headers.emplace_back("Vary", "Origin");
  if (!request.allowed_origin.empty()) answer.headers.emplace_back("Access-Control-Allow-Origin", request.allowed_origin);
  return answer;
}

// Not an empty list: whoever asks is to ask again.
HttpAnswer loading() {
  HttpAnswer answer = short_answer(503, "loading: the data sets are still being read");
  answer.headers.emplace_back("Retry-After", "1");
  return answer;
}

// What a browser asks before it sends a token along.
HttpAnswer preflight() {
  return {.status = 204,
          .headers = {
              {"Access-Control-Allow-Methods", "GET, HEAD"}, {"Access-Control-Allow-Headers", "Authorization"}, {"Access-Control-Max-Age", "600"}}};
}

bool is_known(std::string_view path, const HttpState& state) {
  if (path == "/healthz" || path == "/readyz") return true;
  if (path == "/metrics") return state.door == Door::metrics || !state.has_metrics_door;
  return state.door == Door::all && (path == "/" || path == "/api/datasets");
}

}  // namespace

HttpAnswer short_answer(unsigned status, std::string line) {
  return {.status = status, .body = std::make_shared<const std::string>(std::move(line) + "\n")};
}

const char* text_of(Readiness readiness) {
  switch (readiness) {
    case Readiness::loading:
      return "loading";
    case Readiness::draining:
      return "draining";
    case Readiness::ready:
      break;
  }
  return "ok";
}

HttpAnswer unauthorized() {
  HttpAnswer answer = short_answer(401, "a token is wanted: Authorization: Bearer TOKEN");
  answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
}

HttpAnswer answer(const HttpRequest& request, const HttpState& state) {
  const auto path = decode_path(request.target);
  if (!path) return short_answer(400, "not a target this server can read");
  const StaticFile* const file = state.door == Door::all ? state.viewer.find(*path) : nullptr;
  if (!is_known(*path, state) && file == nullptr) return short_answer(404, "nothing here");
  if (*path == "/api/datasets" && request.method == "OPTIONS" && !request.allowed_origin.empty()) return shared(request, preflight());
  if (request.method != "GET" && request.method != "HEAD") return short_answer(405, "only GET and HEAD");
  if (*path == "/api/datasets") {
    if (request.scope != nullptr && state.readiness == Readiness::loading) return shared(request, loading());
    return shared(request, request.scope != nullptr ? with_body(kJson, datasets_json(state.catalogue, *request.scope)) : unauthorized());
  }
  if (*path == "/metrics" && state.door == Door::all) {
    if (request.scope == nullptr) return unauthorized();
    if (!request.scope->is_everything()) return short_answer(403, "metrics tell of every data set, and this token does not open them all");
  }
  if (*path == "/metrics")
    return with_body(
        kPrometheus,
        state.metrics.text({.catalogue = state.catalogue, .queued_bytes = state.queued_bytes, .certificate_expires = state.certificate_expires}));
  if (*path == "/healthz") return short_answer(200, "ok");
  if (*path == "/readyz") return short_answer(state.readiness == Readiness::ready ? 200 : 503, text_of(state.readiness));
  if (file != nullptr) return file_answer(request, *file);
  return with_body(kHtml, front_page(state.catalogue, request.scope));
}

}  // namespace intervale
