// All cores, behind the sessions' work: for work that takes seconds and cannot be cut into slices, such as loading a data
// set, and measuring how far the surfaces of a range move.
//
// Threads rest after each millisecond of work while sessions wait for a worker, so that those have nine tenths of each
// core. Sessions of heavy accounts do not count: their workers have low priority, too, and must not put off what others
// wait for. Low priority alone does not do: where the system has put two workers on one core, what measures keeps the
// other for half a second.
#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

#include "common/util/parallel.h"
#include "server/serve/fair_scheduler.h"

namespace intervale {

class ScratchMemory;

// Of the thread that makes it, which calls the others, too.
class SpareCores {
 public:
  enum class Rests { no, while_sessions_wait };
  // scheduler: of the sessions. data_memory: where what the work allocates on other threads lies, as with a
  // ScratchMemory::Scope; nullptr: with the rest. Both must outlive this.
  SpareCores(std::stop_token stop, const FairScheduler& scheduler, Rests rests, ScratchMemory* data_memory);
  SpareCores(const SpareCores&) = delete;
  SpareCores& operator=(const SpareCores&) = delete;

  // Throws Stopped, instead of beginning a piece, once stop is requested. Valid as long as this.
  [[nodiscard]] const ParallelFor& all() const { return all_; }
  // The processor time of all threads since the last call.
  FairScheduler::Time take_time();

 private:
  void work(std::size_t begin, std::size_t end, const std::function<void(std::size_t)>& piece);
  void rest_after(FairScheduler::Time time) const;

  std::stop_token stop_;
  const FairScheduler& scheduler_;
  Rests rests_;
  ScratchMemory* data_memory_;
  std::thread::id owner_ = std::this_thread::get_id();
  std::atomic<FairScheduler::Time::rep> others_ = 0;
  FairScheduler::Time own_;
  ParallelFor all_;
};

}  // namespace intervale
