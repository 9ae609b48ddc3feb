// Which data sets sessions want finer scales of (serve --on-demand), and which no session uses: what sessions tell the
// thread that reads files.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace intervale {

// Data sets by name. Any thread. Memory: an entry for each name that a session has used.
class ScaleDemand {
 public:
  using Clock = std::chrono::steady_clock;
  struct EndUse {
    std::string name;
    void operator()(ScaleDemand* demand) const { demand->end_use(name); }
  };
  // While it exists, a session has the data set open.
  using Use = std::unique_ptr<ScaleDemand, EndUse>;

  // What is not wanted any more, because all who asked are gone, is read for so long; what could not be read is not
  // tried again for so long.
  static constexpr std::chrono::seconds kLinger{30}, kRetry{5};

  [[nodiscard]] Use use(const std::string& name);
  // More than `held` updates are wanted. False: a moment ago they could not be had.
  [[nodiscard]] bool ask(const std::string& name, std::uint64_t held, Clock::time_point now = Clock::now());

  // wake: called when something is asked for, on any thread; not any more once it was replaced. It must not call this.
  void set_wake(std::function<void()> wake) {
    const std::lock_guard lock(mutex_);
    wake_ = std::move(wake);
  }
  // Whether more than `held` updates were asked for, and still are wanted.
  [[nodiscard]] bool is_asked(const std::string& name, std::uint64_t held, Clock::time_point now = Clock::now()) const;
  // No more can be had for now.
  void refuse(const std::string& name, Clock::time_point now = Clock::now());
  // Whether no session has used it, or asked for it, for so long. Then what was asked for is forgotten.
  [[nodiscard]] bool is_idle(const std::string& name, Clock::duration time, Clock::time_point now = Clock::now());

 private:
  struct Entry {
    std::size_t sessions = 0;
    Clock::time_point last_use{}, refused{};
    std::uint64_t asked = 0;  // at least so many updates
  };
  void end_use(const std::string& name);

  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  std::function<void()> wake_ = [] {};
};

}  // namespace intervale
