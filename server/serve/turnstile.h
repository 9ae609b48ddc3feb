// Who computes next. Choosing and packing updates takes milliseconds, reading and writing messages microseconds: were all of it done in the order in
// which it comes up, a new connection would wait for every session's next batch.
#pragma once

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace intervale {

// Lets in so many sessions at a time. Any thread.
class Turnstile {
  using LetIn = std::function<void()>;
  struct Waiter;
  using Line = std::list<Waiter>;

 public:
  using Time = std::chrono::steady_clock::duration;
  // Whose view is not answered yet goes before whose stream goes on. But those have an eighth of the time, so that no one waits for ever.
  enum class Turn { answer, more };

  // What a session has had, and where it waits. The session's own; it stays where it is until the session has left.
  class Account {
   public:
    Account() = default;
    Account(const Account&) = delete;
    Account& operator=(const Account&) = delete;

   private:
    friend class Turnstile;
    Time until_{0};        // of the answers' clock: when what it has had is its fair part
    bool long_ = false;    // its last answer took kLong
    int long_inside_ = 0;  // it is inside with such answers
    std::optional<Line::iterator> in_more_;
  };

  explicit Turnstile(unsigned seats) : free_(seats), for_long_(seats > 1 ? seats - 1 : 1) {}
  Turnstile(const Turnstile&) = delete;
  Turnstile& operator=(const Turnstile&) = delete;

  // Completes with void() once it is the session's turn, by way of the handler's executor. The session computes and calls leave(), without waiting
  // for anything in between. A session waits for more once at a time. Answers go by the time that their sessions have had: who asks for what takes
  // long waits for those who do not (start-time fair queueing: P. Goyal, H. M. Vin and H. Cheng, 1996), and leaves them a seat if there are two.
  template <class Token>
  auto enter(Account& account, Turn turn, Token&& token) {
    return boost::asio::async_initiate<Token, void()>(
        [this, &account, turn](auto handler) {
          const auto shared = std::make_shared<decltype(handler)>(std::move(handler));
          queue(account, turn, [shared] { boost::asio::post(boost::asio::get_associated_executor(*shared), std::move(*shared)); });
        },
        token);
  }
  // turn: what the time was spent for.
  void leave(Account& account, Turn turn, Time time);

  // A session that waits to send more now waits to answer. Nothing if it does not wait.
  void hurry(Account& account);

  // Somebody waits.
  [[nodiscard]] bool crowded() const;

  // Forgets those who wait. No thread may be inside.
  void clear();

 private:
  struct Waiter {
    Account* account = nullptr;
    LetIn let_in;
  };
  using Answers = std::multimap<Time, Waiter>;
  static constexpr int kAnswersShare = 7;  // of eight parts
  static constexpr Time kMemory{std::chrono::milliseconds(20)};
  static constexpr Time kLong{std::chrono::milliseconds(50)};
  [[nodiscard]] bool fits(const Account& account) const { return !account.long_ || long_inside_ < for_long_; }
  void begin_answer(Account& account, Time stands);
  void queue(Account& account, Turn turn, LetIn let_in);

  mutable std::mutex mutex_;
  unsigned free_;      // while any is, nobody waits but with answers that do not fit
  unsigned for_long_;  // seats, at most
  unsigned long_inside_ = 0;
  Time ahead_{0};    // what answers took beyond their share, as far as it is remembered
  Time clock_{0};    // of answers: where the one stood that was let in last, or any before it
  Answers answers_;  // by where their sessions stand; of those that stand alike, who came first
  Line more_;
};

}  // namespace intervale
