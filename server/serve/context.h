// What every session of a server shares.
#pragma once

#include <atomic>
#include <cstdint>

#include "server/serve/catalogue.h"
#include "server/serve/connections.h"
#include "server/serve/metrics.h"
#include "server/serve/options.h"
#include "server/serve/static_files.h"
#include "server/serve/turnstile.h"

namespace intervale {

// Outlives every session. The catalogue, the viewer and the options do not change while serving.
struct ServerContext {
  explicit ServerContext(unsigned threads) : turnstile(threads) {}
  ServeOptions options;
  Catalogue catalogue;
  StaticFiles viewer;
  Metrics metrics;
  Connections connections;
  Turnstile turnstile;
  std::atomic<std::uint64_t> next_session_id{1};
};

}  // namespace intervale
