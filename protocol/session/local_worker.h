// What takes long for a session, done on its own thread while there are no messages for it.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include "protocol/session/session_worker.h"

namespace intervale {

// For one session. One thread at a time. What is not measured is found at once, or by brick as the session comes to it.
class LocalWorker : public SessionWorker {
 public:
  // most_bytes: of what is kept of ranges for later.
  explicit LocalWorker(std::size_t most_bytes = std::size_t(64) << 20) : most_bytes_(most_bytes) {}
  LocalWorker(const LocalWorker&) = delete;
  LocalWorker& operator=(const LocalWorker&) = delete;
  ~LocalWorker() override;

  [[nodiscard]] std::shared_ptr<const RangeAnswer> ask(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown,
                                                       Distances distances) override;
  void search(const std::shared_ptr<BudgetSearch>& search) override { search_ = search; }

  // Does one piece of what was asked for last: a slice of a search, or how far one surface moves, about a microsecond for
  // each relevant update. False: there is nothing to do.
  bool work();

 private:
  class Answer;
  struct Found {
    RangePart part;
    RangeAnswer::Relevant relevant;
  };
  [[nodiscard]] RangeAnswer::Relevant find(const RangePart& part, bool may_take_long);
  void go_on(Answer& answer, bool may_take_long);

  std::size_t most_bytes_;
  std::shared_ptr<const IntervalVolume> volume_;  // of the finder, and of what was found
  std::optional<PartFinder> finder_;
  std::list<Found> found_;  // the one used last is the first
  std::weak_ptr<Answer> asked_;
  std::weak_ptr<BudgetSearch> search_;
};

}  // namespace intervale
