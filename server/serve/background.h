// Work that takes long, in slices, behind the sessions' other work.
#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "server/serve/fair_scheduler.h"
#include "server/serve/memory.h"

namespace intervale {

// Threads of low priority. Of each account one piece of work at a time is under way, in order of arrival, so that an account
// has the memory of one only; slice by slice the account goes on that spent least. Any thread.
class Background {
 public:
  using Payer = std::shared_ptr<FairScheduler::Account>;

  // scheduler: of the accounts that pay. Both must outlive this. threads: at least 1.
  Background(FairScheduler& scheduler, Memory& memory, unsigned threads);
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  ~Background() { stop(); }

  // slice: works for about a millisecond and returns whether there is more to do; throws nothing. It says in its share of
  // what sessions hold how much memory the work has, until it is done. on_done: called once when there is no more to do,
  // without any lock held. Both on another thread.
  using Slice = std::function<bool(Memory::Share& held)>;
  void run(Payer payer, Slice slice, std::function<void()> on_done);

  // Begins no slice any more. Also done on destruction.
  void stop();

 private:
  struct Work {
    Payer payer;
    Slice slice;
    std::function<void()> on_done;
    Memory::Share held;
    bool is_busy = false;  // a thread is in a slice
  };
  using Works = std::list<Work>;
  [[nodiscard]] Works::iterator next();
  void serve(const std::stop_token& stop);

  FairScheduler& scheduler_;
  Memory& memory_;
  std::mutex mutex_;
  std::condition_variable_any has_work_;
  Works works_;  // in order of arrival
  std::vector<std::jthread> threads_;
};

}  // namespace intervale
