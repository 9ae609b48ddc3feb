// What every session of a server shares.
#pragma once

#include <atomic>
#include <cstdint>

#include "protocol/transport/tls.h"
#include "server/serve/access.h"
#include "server/serve/catalogue.h"
#include "server/serve/connections.h"
#include "server/serve/guard.h"
#include "server/serve/metrics.h"
#include "server/serve/options.h"
#include "server/serve/replaceable.h"
#include "server/serve/static_files.h"
#include "server/serve/turnstile.h"

namespace intervale {

// Outlives every session. The viewer and the options do not change while serving.
struct ServerContext {
  explicit ServerContext(const ServeOptions& wanted) : options(wanted), outbox(wanted.max_queued_bytes), turnstile(wanted.threads) {}
  const ServeOptions options;        // threads is not 0
  Replaceable<Catalogue> catalogue;  // nullptr until it is loaded
  StaticFiles viewer;
  Metrics metrics;
  Replaceable<Tokens> tokens;   // nullptr: whoever comes may see everything
  Replaceable<TlsContext> tls;  // nullptr: plain
  Connections connections;
  AddressCounts addresses;
  Outbox outbox;
  Turnstile turnstile;
  std::atomic<std::uint64_t> next_session_id{1};
};

}  // namespace intervale
