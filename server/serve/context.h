// What every session of a server shares.
#pragma once

#include <atomic>
#include <cstdint>

#include "protocol/transport/tls.h"
#include "server/serve/access.h"
#include "server/serve/admission.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/catalogue.h"
#include "server/serve/connections.h"
#include "server/serve/fair_scheduler.h"
#include "server/serve/metrics.h"
#include "server/serve/options.h"
#include "server/serve/static_files.h"

namespace intervale {

// Outlives every session. The viewer and the options do not change while serving.
struct ServerContext {
  explicit ServerContext(const ServeOptions& wanted) : options(wanted), write_budget(wanted.max_queued_bytes), scheduler(wanted.threads) {}
  const ServeOptions options;            // threads is not 0
  AtomicSharedPtr<Catalogue> catalogue;  // nullptr until it is loaded
  StaticFiles viewer;
  Metrics metrics;
  AtomicSharedPtr<Tokens> tokens;   // nullptr: whoever comes may see everything
  AtomicSharedPtr<TlsContext> tls;  // nullptr: plain
  Connections connections;
  AddressCounts addresses;
  WriteBudget write_budget;
  FairScheduler scheduler;
  std::atomic<std::uint64_t> next_session_id{1};
};

}  // namespace intervale
