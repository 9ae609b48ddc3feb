// The state that all sessions of a server share.
#pragma once

#include <atomic>
#include <cstdint>

#include "protocol/transport/tls.h"
#include "server/serve/access.h"
#include "server/serve/accounts.h"
#include "server/serve/admission.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/background.h"
#include "server/serve/catalogue.h"
#include "server/serve/connections.h"
#include "server/serve/fair_scheduler.h"
#include "server/serve/memory.h"
#include "server/serve/metrics.h"
#include "server/serve/options.h"
#include "server/serve/range_cache.h"
#include "server/serve/scale_demand.h"
#include "server/serve/static_files.h"

namespace intervale {

// Outlives every session. options and viewer do not change while serving.
struct ServerContext {
  explicit ServerContext(const ServeOptions& requested)
      : options(requested),
        memory(requested.max_memory, requested.data_memory),
        scheduler(requested.threads),
        background(scheduler, memory, requested.threads),
        write_budget(requested.max_queued_bytes) {}
  const ServeOptions options;            // threads is not 0
  Memory memory;                         // before its holders
  AtomicSharedPtr<Catalogue> catalogue;  // nullptr: still loading
  ScaleDemand scale_demand;              // with options.on_demand
  FairScheduler scheduler;
  Accounts accounts{scheduler};
  RangeCache ranges{memory, scheduler};
  Background background;
  StaticFiles viewer;
  Metrics metrics;
  AtomicSharedPtr<Tokens> tokens;   // nullptr: no token is required
  AtomicSharedPtr<TlsContext> tls;  // nullptr: plain TCP
  Connections connections;
  AddressCounts addresses;
  WriteBudget write_budget;
  std::atomic<std::uint64_t> next_session_id{1};
};

}  // namespace intervale
