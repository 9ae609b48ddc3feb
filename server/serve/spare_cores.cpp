#include "server/serve/spare_cores.h"

#include <chrono>
#include <optional>
#include <utility>

#include "common/parallel/all_cores.h"
#include "server/scratch/scratch_memory.h"
#include "server/serve/thread_time.h"

namespace intervale {

SpareCores::SpareCores(std::stop_token stop, const FairScheduler& scheduler, Rests rests, ScratchMemory* data_memory)
    : stop_(std::move(stop)),
      scheduler_(scheduler),
      rests_(rests),
      data_memory_(data_memory),
      own_(thread_time()),
      all_([this](std::size_t count, const std::function<void(std::size_t)>& piece) {
        on_all_cores_in_runs(count, [&](std::size_t begin, std::size_t end) { work(begin, end, piece); });
      }) {}

// Pieces one after the other, on any thread.
void SpareCores::work(std::size_t begin, std::size_t end, const std::function<void(std::size_t)>& piece) {
  const bool is_other = std::this_thread::get_id() != owner_;
  std::optional<ScratchMemory::Scope> scope;
  if (is_other && data_memory_ != nullptr) scope.emplace(data_memory_);
  for (std::size_t i = begin; i < end; ++i) {
    if (stop_.stop_requested()) throw Stopped();
    const FairScheduler::Time since = thread_time();
    piece(i);
    const FairScheduler::Time time = thread_time() - since;
    if (is_other) others_ += time.count();
    if (rests_ == Rests::while_sessions_wait) rest_after(time);
  }
}

// time: of a piece, on this thread.
void SpareCores::rest_after(FairScheduler::Time time) const {
  constexpr FairScheduler::Time kSlice = std::chrono::milliseconds(1), kRest = std::chrono::milliseconds(2);
  thread_local FairScheduler::Time worked{0};
  worked += time;
  if (worked < kSlice) return;
  const auto until = FairScheduler::Clock::now() + 9 * std::exchange(worked, FairScheduler::Time(0));
  while (scheduler_.has_waiters(FairScheduler::Lane::usual) && !stop_.stop_requested() && FairScheduler::Clock::now() < until)
    std::this_thread::sleep_for(kRest);
}

FairScheduler::Time SpareCores::take_time() {
  const FairScheduler::Time own = thread_time();
  return own - std::exchange(own_, own) + FairScheduler::Time(others_.exchange(0));
}

}  // namespace intervale
