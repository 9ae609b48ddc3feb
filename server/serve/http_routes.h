// What the server answers over HTTP: a pure function of the request. No I/O.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/serve/access.h"
#include "server/serve/catalogue.h"
#include "server/serve/metrics.h"
#include "server/serve/static_files.h"

namespace intervale {

struct HttpRequest {
  std::string_view method;
  std::string_view target;
  // Headers; empty: not there.
  std::string_view host;
  std::string_view accept_encoding;
  std::string_view if_none_match;
  std::string_view allowed_origin;  // of a page from elsewhere that may open sessions here; empty: there is none, or it may not
  const Scope* scope = nullptr;     // what whoever asks may see; nullptr: only what everybody may
};

struct HttpResponse {
  unsigned status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body = {};  // nullptr: none, in a 304
  std::string content_security_policy = "default-src 'none'";
  std::string cache_control = "no-store";
  std::vector<std::pair<std::string, std::string>> headers = {};  // besides those and those of every answer
};

// An answer of one line.
[[nodiscard]] HttpResponse text_response(unsigned status, std::string line);
// 401: what whoever has no token gets.
[[nodiscard]] HttpResponse unauthorized();

// What a port is for: everything, or nothing but /metrics, /healthz and /readyz.
enum class PortRole { all, metrics };

// loading: before there is a catalogue. draining: nobody new is taken.
enum class ServerStatus { loading, ready, draining };
[[nodiscard]] const char* text_of(ServerStatus server_status);

struct HttpState {
  const Catalogue& catalogue;
  const Metrics& metrics;
  const StaticFiles& viewer;
  std::uint64_t queued_bytes = 0;
  PortRole role = PortRole::all;
  bool has_metrics_port = false;  // then /metrics is answered there only
  std::optional<std::chrono::system_clock::time_point> certificate_expires = {};
  ServerStatus server_status = ServerStatus::ready;
};

// GET and HEAD of /api/datasets, /healthz, /readyz, /metrics, and of the viewer's files: / is its index.html, or without a viewer a page that lists
// the data sets. A query is ignored. Pages of allowed origins may read /api/datasets, with a token (CORS, Fetch standard, 3.2); until it is known
// what there is, it is 503. With no scope 401 for what tells of data sets; with one that is not everything 403 for /metrics, which tells of all,
// unless it has a role of its own. 405 for other methods, 404 for other targets, 400 for those that cannot be read. HEAD is answered like GET;
// whoever sends it leaves the body out.
[[nodiscard]] HttpResponse respond(const HttpRequest& request, const HttpState& state);

}  // namespace intervale
