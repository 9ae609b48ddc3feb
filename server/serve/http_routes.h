// The HTTP API: a pure function from request and server state to response. No I/O.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/serve/access.h"
#include "server/serve/catalogue.h"
#include "server/serve/memory.h"
#include "server/serve/metrics.h"
#include "server/serve/static_files.h"

namespace intervale {

struct HttpRequest {
  std::string_view method;
  std::string_view target;
  // Header fields; empty if absent.
  std::string_view host;
  std::string_view accept_encoding;
  std::string_view if_none_match;
  std::string_view allowed_origin;  // the Origin, if it is another host's and --allow-origin names it; else empty
  const Scope* scope = nullptr;     // what the token grants; nullptr: no valid token
};

struct HttpResponse {
  unsigned status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body = {};  // nullptr: none, in 204 and 304
  std::string content_security_policy = "default-src 'none'";
  std::string cache_control = "no-store";
  std::vector<std::pair<std::string, std::string>> headers = {};  // besides those above and those of every response
};

// A response of one line of text.
[[nodiscard]] HttpResponse text_response(unsigned status, std::string line);
// 503: the client may try again after so many seconds.
[[nodiscard]] HttpResponse retry_later(std::string line, const char* seconds);
// 401: the request has no valid token.
[[nodiscard]] HttpResponse unauthorized();

// all: the main port. metrics: serves /metrics, /healthz and /readyz only.
enum class PortRole { all, metrics };

// loading: the data sets are being read. full: no new sessions, at the limit of sessions or of memory. draining: no new
// sessions, the server shuts down.
enum class ServerStatus { loading, ready, full, draining };
[[nodiscard]] const char* text_of(ServerStatus status);  // for /readyz: "loading", "ok", "full", "draining"

struct HttpState {
  const Catalogue& catalogue;
  const Metrics& metrics;
  const Memory& memory;
  const StaticFiles& viewer;
  std::uint64_t queued_bytes = 0;
  PortRole role = PortRole::all;
  bool has_metrics_port = false;  // then the main port does not serve /metrics
  std::optional<std::chrono::system_clock::time_point> certificate_expires = {};
  ServerStatus server_status = ServerStatus::ready;
  std::span<const std::string> connect_origins = {};  // of ServeOptions
};

// Whether a text is an origin that a policy of a page can name: http:// or https://, a host (a name, or an IPv4 address)
// and, if need be, a port; nothing else.
[[nodiscard]] bool is_connect_origin(std::string_view text);

// Serves GET and HEAD of /api/datasets, /healthz, /readyz, /metrics, and the viewer's files; / is the viewer's
// index.html, or without a viewer a page that lists the data sets. The query is ignored. HEAD has the body of GET;
// the caller omits it.
// - 400: the target cannot be decoded. 404: unknown path. 405: another method.
// - 401: no valid token, for /api/datasets and /metrics. 403: /metrics, if the token does not grant every data set.
//   The metrics port requires no token.
// - 503: /readyz while the server is not ready, or refuses new sessions; /api/datasets while the data sets are being read.
// Pages of allowed origins may read /api/datasets with a token (CORS: Fetch standard, 3.2).
[[nodiscard]] HttpResponse respond(const HttpRequest& request, const HttpState& state);

}  // namespace intervale
