// What the server answers over HTTP: a pure function of the request. No I/O.
#pragma once

#include <string>
#include <string_view>

#include "server/serve/catalogue.h"
#include "server/serve/metrics.h"

namespace intervale {

struct HttpAnswer {
  unsigned status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
};

struct HttpState {
  const Catalogue& catalogue;
  const Metrics& metrics;
  bool ready;  // false while draining
};

// GET and HEAD of /, /api/datasets, /healthz, /readyz, /metrics; a query is ignored. 405 for other methods, 404 for other targets. HEAD is
// answered like GET; whoever sends it leaves the body out.
[[nodiscard]] HttpAnswer answer(std::string_view method, std::string_view target, const HttpState& state);

}  // namespace intervale
