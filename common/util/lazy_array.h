// Values that are made when they are first asked for.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

namespace intervale {

// Any thread. Two threads may make the same value at once: one of both is kept. No thread waits for another.
template <class T>
class LazyArray {
 public:
  explicit LazyArray(std::size_t size = 0) : values_(size) {}
  LazyArray(const LazyArray&) = delete;
  LazyArray& operator=(const LazyArray&) = delete;
  ~LazyArray() {
    for (const auto& value : values_) delete value.load(std::memory_order_relaxed);
  }

  [[nodiscard]] std::size_t size() const { return values_.size(); }
  // nullptr: not made yet.
  [[nodiscard]] const T* find(std::size_t i) const { return values_[i].load(std::memory_order_acquire); }
  // Keeps the value unless there is one already. Returns the one that is kept, and whether it is this one.
  struct Kept {
    const T& value;
    bool is_new;
  };
  Kept keep(std::size_t i, T&& value) {
    auto made = std::make_unique<const T>(std::move(value));
    const T* other = nullptr;
    if (values_[i].compare_exchange_strong(other, made.get(), std::memory_order_acq_rel)) return {*made.release(), true};
    return {*other, false};
  }

 private:
  std::vector<std::atomic<const T*>> values_;
};

}  // namespace intervale
