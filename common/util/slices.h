// A long computation in slices: a coroutine that suspends itself now and then.
#pragma once

#include <exception>
#include <utility>
#if __has_include(<coroutine>)
#include <coroutine>
namespace intervale::coroutines {
using std::coroutine_handle, std::suspend_always;
}
#else  // Emscripten's library has them by an older name
#include <experimental/coroutine>
namespace intervale::coroutines {
using std::experimental::coroutine_handle, std::experimental::suspend_always;
}
#endif

namespace intervale {

// The return type of such a coroutine, which says `co_await Slices::kPause` between two slices. What the coroutine refers
// to must outlive it. One thread at a time.
class Slices {
 public:
  static constexpr coroutines::suspend_always kPause{};
  struct promise_type {  // NOLINT(readability-identifier-naming): the language's name
    std::exception_ptr failure;
    Slices get_return_object() { return Slices(coroutines::coroutine_handle<promise_type>::from_promise(*this)); }
    static coroutines::suspend_always initial_suspend() noexcept { return {}; }
    static coroutines::suspend_always final_suspend() noexcept { return {}; }
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
  explicit Slices(coroutines::coroutine_handle<promise_type> coroutine) : coroutine_(coroutine) {}
  coroutines::coroutine_handle<promise_type> coroutine_;
};

}  // namespace intervale
