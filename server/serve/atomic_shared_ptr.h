// A shared pointer that is replaced while other threads read it.
#pragma once

#include <memory>
#include <mutex>

namespace intervale {

// Any thread. Stands for std::atomic<std::shared_ptr<const T>>, whose implementation in libstdc++ 12 the thread
// sanitizer reports as a data race.
template <class T>
class AtomicSharedPtr {
 public:
  [[nodiscard]] std::shared_ptr<const T> load() const {
    const std::lock_guard lock(mutex_);
    return value_;
  }
  void store(std::shared_ptr<const T> value) {
    const std::lock_guard lock(mutex_);
    value_.swap(value);  // the old value is destroyed after the lock is released
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const T> value_;
};

}  // namespace intervale
