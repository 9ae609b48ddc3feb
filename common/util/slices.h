// A long computation in slices: a coroutine that suspends itself now and then.
#pragma once

#include <coroutine>
#include <exception>
#include <utility>

namespace intervale {

// The return type of such a coroutine, which says `co_await Slices::kPause` between two slices. What the coroutine refers
// to must outlive it. One thread at a time.
class Slices {
 public:
  static constexpr std::suspend_always kPause{};
  struct promise_type {  // NOLINT(readability-identifier-naming): the language's name
    std::exception_ptr failure;
    Slices get_return_object() { return Slices(std::coroutine_handle<promise_type>::from_promise(*this)); }
    static std::suspend_always initial_suspend() noexcept { return {}; }
    static std::suspend_always final_suspend() noexcept { return {}; }
    void return_void() noexcept {}
    void unhandled_exception() noexcept { failure = std::current_exception(); }
  };

  Slices(Slices&& other) noexcept : coroutine_(std::exchange(other.coroutine_, {})) {}
  Slices& operator=(Slices&& other) noexcept {
    std::swap(coroutine_, other.coroutine_);
    return *this;
  }
  ~Slices() {
    if (coroutine_) coroutine_.destroy();
  }

  // Computes the next slice. False if that was the last one; call it no more then. Throws what the computation throws.
  bool resume() {
    coroutine_.resume();
    if (coroutine_.promise().failure) std::rethrow_exception(coroutine_.promise().failure);
    return !coroutine_.done();
  }

 private:
  explicit Slices(std::coroutine_handle<promise_type> coroutine) : coroutine_(coroutine) {}
  std::coroutine_handle<promise_type> coroutine_;
};

}  // namespace intervale
