// Which data sets sessions want finer scales of (serve --on-demand), and which no session uses: what sessions tell the
// thread that reads files.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "common/ivm/interval_volume.h"

namespace intervale {

// Data sets by name, and what is there of them by identity: who has other contents than those that are served, or less
// of them, wants nothing. Any thread. Memory: an entry for each name that a session has used.
class ScaleDemand {
 public:
  using Clock = std::chrono::steady_clock;

  // What could not be read is not tried again for so long: twice as long with each time, up to the other.
  static constexpr std::chrono::seconds kRetry{5}, kLongestRetry{60};

  // While it exists, a session has the data set open. One thread at a time. The demand must outlive it.
  class Use {
   public:
    Use(ScaleDemand& demand, std::string name);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    // held: what the session has of it, if it wants more; only the address is kept. nullptr: it wants no more. False: a
    // moment ago no more could be had, and it is not waited for.
    [[nodiscard]] bool want(const IntervalVolume* held, Clock::time_point now = Clock::now());

   private:
    ScaleDemand& demand_;
    std::string name_;
    const IntervalVolume* wanted_ = nullptr;
  };

  // wake: called when a session wants more, on any thread; not any more once it was replaced. It must not call this.
  void set_wake(std::function<void()> wake) {
    const std::lock_guard lock(mutex_);
    wake_ = std::move(wake);
  }
  // Whether a session has this, and wants more.
  [[nodiscard]] bool is_wanted(const IntervalVolume& held, Clock::time_point now = Clock::now()) const;
  // More than this cannot be had for now.
  void refuse(const IntervalVolume& held, Clock::time_point now = Clock::now());
  // Whether no session has used it for so long.
  [[nodiscard]] bool is_idle(const std::string& name, Clock::duration time, Clock::time_point now = Clock::now()) const;

 private:
  struct Entry {
    std::size_t sessions = 0;
    Clock::time_point last_use{};
    // What was refused, how often in a row, and until when.
    std::uint64_t contents = 0, updates = 0;
    unsigned refusals = 0;
    Clock::time_point refused_until{};
    [[nodiscard]] bool refuses(const IntervalVolume& held) const;
  };
  void forget(const IntervalVolume* wanted);

  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  std::map<const IntervalVolume*, std::size_t> wanted_;  // by how many sessions
  std::function<void()> wake_ = [] {};
};

}  // namespace intervale
