#include "server/serve/background.h"

#include <boost/unordered/unordered_flat_set.hpp>
#include <utility>

#include "common/parallel/all_cores.h"
#include "server/scratch/scratch_memory.h"
#include "server/serve/thread_time.h"

namespace intervale {

Background::Background(FairScheduler& scheduler, Memory& memory, unsigned threads) : scheduler_(scheduler), memory_(memory) {
  threads_.reserve(threads);
  for (unsigned i = 0; i < threads; ++i) threads_.emplace_back([this](const std::stop_token& stop) { serve(stop); });
}

void Background::run(Payer payer, Slice slice, std::function<void()> on_done) {
  const std::lock_guard lock(mutex_);
  works_.push_back({std::move(payer), std::move(slice), std::move(on_done), Memory::Share(memory_, Memory::Holder::sessions, 0)});
  has_work_.notify_one();
}

void Background::stop() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
}

// With the lock held. works_.end(): nothing can go on.
Background::Works::iterator Background::next() {
  boost::unordered_flat_set<const FairScheduler::Account*> seen;
  auto next = works_.end();
  FairScheduler::Time least{};
  for (auto work = works_.begin(); work != works_.end(); ++work) {
    if (!seen.insert(work->payer.get()).second || work->is_busy) continue;
    const FairScheduler::Time spent = scheduler_.spent(*work->payer);
    if (next != works_.end() && spent >= least) continue;
    least = spent;
    next = work;
  }
  return next;
}

void Background::serve(const std::stop_token& stop) {
  yield_to_other_threads();
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const auto work = next();
    if (work == works_.end()) {
      has_work_.wait(lock, stop, [this] { return next() != works_.end(); });
      continue;
    }
    work->is_busy = true;
    lock.unlock();
    const auto since = thread_time();
    const bool has_more = [&] {
      const ScratchMemory::Reading data_sets;
      return work->slice(work->held);
    }();
    scheduler_.charge(*work->payer, thread_time() - since);
    lock.lock();
    work->is_busy = false;
    if (has_more) continue;
    Work done = std::move(*work);
    works_.erase(work);
    done.held.resize(0);
    has_work_.notify_one();  // the account's next work may begin
    lock.unlock();
    done.on_done();
    lock.lock();
  }
}

}  // namespace intervale
