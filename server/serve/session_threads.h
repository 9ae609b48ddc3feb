// What a server is for one session: the data sets that it is granted, and threads that work for it.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "protocol/session/session_state.h"
#include "protocol/session/session_worker.h"
#include "server/serve/access.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/background.h"
#include "server/serve/catalogue.h"
#include "server/serve/range_cache.h"

namespace intervale {

// The data sets of the catalogue that are granted; nullptr: none. catalogue: must outlive the result; it may change.
[[nodiscard]] SessionState::Find find_granted(const AtomicSharedPtr<Catalogue>& catalogue, std::shared_ptr<const Scope> scope);

// One thread at a time.
class SessionThreads : public SessionWorker {
 public:
  // payer: of what they do for the session. ranges and background must outlive this.
  SessionThreads(RangeCache& ranges, Background& background, Background::Payer payer)
      : ranges_(ranges), background_(background), payer_(std::move(payer)) {}

  // Before the session's first message. wake: called on another thread when a session that waits should go on; perhaps
  // also later, even after the session.
  void set_wake(std::function<void()> wake) { wake_ = std::move(wake); }

  [[nodiscard]] std::shared_ptr<const RangeAnswer> ask(const RangeCache::Volume& volume, const ShownRanges& shown, Distances distances) override;
  void search(const std::shared_ptr<BudgetSearch>& search) override;

 private:
  RangeCache& ranges_;
  Background& background_;
  Background::Payer payer_;
  std::function<void()> wake_ = [] {};
};

}  // namespace intervale
