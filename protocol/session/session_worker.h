// Who does what takes long for a session: threads of a server, or the only thread while the session waits.
#pragma once

#include <memory>

#include "common/ivm/budget_search.h"
#include "common/ivm/interval_volume.h"
#include "common/ranges/find_relevant_updates.h"

namespace intervale {

// What one range needs, once it is found.
class RangeAnswer {
 public:
  using Relevant = std::shared_ptr<const RelevantUpdates>;
  virtual ~RangeAnswer() = default;
  [[nodiscard]] virtual bool is_ready() const = 0;
  // No distances have to be measured for it.
  [[nodiscard]] virtual bool is_soon() const = 0;
  // Waits for it. Throws what prevented it, for example that memory is exhausted.
  [[nodiscard]] virtual Relevant result() const = 0;
};

class SessionWorker {
 public:
  virtual ~SessionWorker() = default;
  // Finds what ranges need of a volume. shown: as distinct() gives them, one at least. Some distances may be better known
  // than asked for. Nothing is found for answers that are released before their turn.
  [[nodiscard]] virtual std::shared_ptr<const RangeAnswer> ask(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown,
                                                               Distances distances) = 0;
  // Goes on with a search until it is done, or nobody else has it.
  virtual void search(const std::shared_ptr<BudgetSearch>& search) = 0;
};

}  // namespace intervale
