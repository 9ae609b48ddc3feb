// Who computes next. Choosing and packing updates takes milliseconds, reading and writing messages microseconds: were all of it done in the order in
// which it comes up, a new connection would wait for every session's next batch.
#pragma once

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace intervale {

// Lets in so many sessions at a time. Any thread.
class Turnstile {
 public:
  using Id = std::uint64_t;  // of a session
  using Time = std::chrono::steady_clock::duration;
  // Whose view is not answered yet goes before whose stream goes on. But those have an eighth of the time, so that no one waits for ever.
  enum class Turn { answer, more };

  explicit Turnstile(unsigned seats) : free_(seats) {}
  Turnstile(const Turnstile&) = delete;
  Turnstile& operator=(const Turnstile&) = delete;

  // Completes with void() once it is the session's turn, by way of the handler's executor. The session computes and calls leave(), without waiting
  // for anything in between. A session waits for more once at a time.
  template <class Token>
  auto enter(Id session, Turn turn, Token&& token) {
    return boost::asio::async_initiate<Token, void()>(
        [this, session, turn](auto handler) {
          const auto shared = std::make_shared<decltype(handler)>(std::move(handler));
          queue(session, turn, [shared] { boost::asio::post(boost::asio::get_associated_executor(*shared), std::move(*shared)); });
        },
        token);
  }
  // turn: what the time was spent for.
  void leave(Turn turn, Time time);

  // A session that waits to send more now waits to answer. Nothing if it does not wait.
  void hurry(Id session);

  // Somebody waits.
  [[nodiscard]] bool crowded() const;

  // Forgets those who wait. No thread may be inside.
  void clear();

 private:
  using LetIn = std::function<void()>;
  struct Waiter {
    Id session = 0;
    LetIn let_in;
  };
  using Line = std::list<Waiter>;
  static constexpr int kAnswersShare = 7;  // of eight parts
  static constexpr Time kMemory{std::chrono::milliseconds(20)};
  void queue(Id session, Turn turn, LetIn let_in);

  mutable std::mutex mutex_;
  unsigned free_;
  Time ahead_{0};  // what answers took beyond their share, as far as it is remembered
  Line answers_, more_;
  std::unordered_map<Id, Line::iterator> in_more_;
};

}  // namespace intervale
