// std::atomic_ref, also for Emscripten's library, which lacks it.
#pragma once

#include <atomic>
#include <utility>

namespace intervale {

#ifdef __cpp_lib_atomic_ref
template <class T>
using AtomicRef = std::atomic_ref<T>;
#else  // there is one thread
template <class T>
class AtomicRef {
 public:
  explicit AtomicRef(T& to) : to_(to) {}
  [[nodiscard]] T load(std::memory_order) const { return to_; }
  void store(T value, std::memory_order) const { to_ = value; }
  T fetch_add(T value, std::memory_order) const { return std::exchange(to_, to_ + value); }
  bool compare_exchange_weak(T& expected, T value, std::memory_order) const {
    if (to_ != expected) {
      expected = to_;
      return false;
    }
    to_ = value;
    return true;
  }

 private:
  T& to_;
};
#endif

}  // namespace intervale
