#include "server/serve/http_routes.h"

#include <algorithm>
#include <array>
#include <boost/algorithm/string/replace.hpp>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "common/program/describe.h"
#include "protocol/session/data_set_json.h"

namespace intervale {
namespace {

constexpr const char* kHtml = "text/html; charset=utf-8";
constexpr const char* kJson = "application/json";
constexpr const char* kPrometheus = "text/plain; version=0.0.4; charset=utf-8";

std::string html_escaped(std::string text) {
  boost::replace_all(text, "&", "&amp;");  // first: the others insert it
  boost::replace_all(text, "<", "&lt;");
  boost::replace_all(text, ">", "&gt;");
  boost::replace_all(text, "\"", "&quot;");
  return text;
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
      "far as the client asks. Fetch one with <code>intervale-client fetch ws://HOST:PORT/NAME -o mesh.vtu</code>.</p>\n<ul>\n";
  for (const auto& [name, volume] : catalogue.volumes()) {
    if (scope == nullptr || !scope->allows(name)) continue;
    const Description& d = volume->description();
    page += "<li>" + html_escaped(name) + ": " + std::to_string(d.grid.dims[0]) + " × " + std::to_string(d.grid.dims[1]) + " × " +
            std::to_string(d.grid.dims[2]) + " samples, " + std::to_string(d.updates) + " updates, " +
            (d.has_every_range ? "every range" : std::to_string(d.full.tets) + " tetrahedra in full") + "</li>\n";
  }
  return page + "</ul>\n<p><a href=\"/api/datasets\">As JSON</a>. This server has no viewer: see its option <code>--viewer</code>.</p>\n</html>\n";
}

HttpResponse ok(const char* content_type, std::string body) {
  return {.content_type = content_type, .body = std::make_shared<const std::string>(std::move(body))};
}

// The WebSocket sources of the policy. 'self' does not cover them in every browser, so the request's host is named. A
// host with characters that a policy cannot hold (an IPv6 address in brackets) allows every host.
std::string websocket_sources(std::string_view host) {
  const bool plain = !host.empty() &&
                     std::all_of(host.begin(), host.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '.' || c == '-' || c == ':'; });
  if (!plain) return "ws: wss:";
  return "ws://" + std::string(host) + " wss://" + std::string(host);
}

std::string viewer_policy(std::string_view host, std::span<const std::string> origins) {
  std::string sources = websocket_sources(host);
  for (const std::string& origin : origins) sources += " " + origin;
  return "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' " + sources +
         "; worker-src 'self'; manifest-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";
}

HttpResponse file_response(const HttpRequest& request, const StaticFile& file, std::span<const std::string> origins) {
  const bool use_gzip = file.gzip && accepts_gzip(request.accept_encoding);
  const StaticContent& content = use_gzip ? *file.gzip : file.plain;
  HttpResponse response{.content_type = file.content_type, .body = content.bytes, .content_security_policy = viewer_policy(request.host, origins)};
  response.cache_control = file.immutable ? "public, max-age=31536000, immutable" : "no-cache";
  response.headers = {{"ETag", content.etag}};
  if (file.gzip) response.headers.emplace_back("Vary", "Accept-Encoding");
  if (matches_etag(request.if_none_match, content.etag)) {
    response.status = 304;
    response.body = nullptr;
  } else if (use_gzip) {
    response.headers.emplace_back("Content-Encoding", "gzip");
  }
  return response;
}

// Lets pages of allowed origins read the response (CORS).
HttpResponse with_cors(const HttpRequest& request, HttpResponse response) {
  response.headers.emplace_back("Vary", "Origin");
  if (!request.allowed_origin.empty()) response.headers.emplace_back("Access-Control-Allow-Origin", request.allowed_origin);
  return response;
}

// A browser's CORS preflight, before it sends a token.
HttpResponse preflight() {
  return {.status = 204,
          .headers = {
              {"Access-Control-Allow-Methods", "GET, HEAD"}, {"Access-Control-Allow-Headers", "Authorization"}, {"Access-Control-Max-Age", "600"}}};
}

constexpr std::string_view kList = "/api/datasets";

bool is_api(std::string_view path) { return path.starts_with(kList) && (path.size() == kList.size() || path[kList.size()] == '/'); }

// The list, or one data set of it.
HttpResponse datasets_response(const HttpRequest& request, const HttpState& state, std::string_view path) {
  if (request.scope == nullptr) return unauthorized();
  // An empty list would be wrong.
  if (state.server_status == ServerStatus::loading) return retry_later("loading: the data sets are still being read", "1");
  if (path.size() == kList.size()) return ok(kJson, datasets_json(state.catalogue, *request.scope));
  const std::string name(path.substr(kList.size() + 1));
  const auto volume = request.scope->allows(name) ? state.catalogue.find(name) : nullptr;
  return volume ? ok(kJson, data_set_json(*volume)) : text_response(404, "no such data set; see /api/datasets");
}

bool is_known(std::string_view path, const HttpState& state) {
  if (path == "/healthz" || path == "/readyz") return true;
  if (path == "/metrics") return state.role == PortRole::metrics || !state.has_metrics_port;
  return state.role == PortRole::all && (path == "/" || is_api(path));
}

}  // namespace

bool is_connect_origin(std::string_view text) {
  const std::size_t scheme = text.starts_with("https://") ? 8 : text.starts_with("http://") ? 7 : 0;
  if (scheme == 0) return false;
  const std::size_t colon = std::min(text.find(':', scheme), text.size());
  const std::string_view host = text.substr(scheme, colon - scheme), port = text.substr(std::min(colon + 1, text.size()));
  const auto is_of_host = [](unsigned char c) { return c < 0x80 && (std::isalnum(c) != 0 || c == '.' || c == '-'); };
  if (host.empty() || !std::all_of(host.begin(), host.end(), is_of_host)) return false;
  std::uint16_t number = 0;
  const auto [stop, failure] = std::from_chars(port.data(), port.data() + port.size(), number);
  return colon == text.size() || (failure == std::errc() && stop == port.data() + port.size() && number != 0);
}

HttpResponse text_response(unsigned status, std::string line) {
  return {.status = status, .body = std::make_shared<const std::string>(std::move(line) + "\n")};
}

HttpResponse retry_later(std::string line, const char* seconds) {
  HttpResponse response = text_response(503, std::move(line));
  response.headers.emplace_back("Retry-After", seconds);
  return response;
}

const char* text_of(ServerStatus status) { return std::array{"loading", "ok", "full", "draining"}[std::size_t(status)]; }

HttpResponse unauthorized() {
  HttpResponse response = text_response(401, "a token is required: Authorization: Bearer TOKEN");
  response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

HttpResponse respond(const HttpRequest& request, const HttpState& state) {
  const auto path = decode_path(request.target);
  if (!path) return text_response(400, "malformed request target");
  const StaticFile* const file = state.role == PortRole::all ? state.viewer.find(*path) : nullptr;
  if (!is_known(*path, state) && file == nullptr) return text_response(404, "not found");
  if (is_api(*path) && request.method == "OPTIONS" && !request.allowed_origin.empty()) return with_cors(request, preflight());
  if (request.method != "GET" && request.method != "HEAD") return text_response(405, "method not allowed: use GET or HEAD");
  if (is_api(*path)) return with_cors(request, datasets_response(request, state, *path));
  if (*path == "/metrics" && state.role == PortRole::all) {
    if (request.scope == nullptr) return unauthorized();
    if (!request.scope->is_everything()) return text_response(403, "metrics cover every data set: a token that grants all of them is required");
  }
  if (*path == "/metrics") {
    return ok(kPrometheus, state.metrics.text({.catalogue = state.catalogue,
                                               .memory = state.memory,
                                               .queued_bytes = state.queued_bytes,
                                               .certificate_expires = state.certificate_expires}));
  }
  if (*path == "/healthz") return text_response(200, "ok");
  if (*path == "/readyz") return text_response(state.server_status == ServerStatus::ready ? 200 : 503, text_of(state.server_status));
  if (file != nullptr) return file_response(request, *file, state.connect_origins);
  return ok(kHtml, front_page(state.catalogue, request.scope));
}

}  // namespace intervale
