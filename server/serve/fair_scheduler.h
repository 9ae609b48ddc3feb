// Schedules the sessions' computations on a limited number of workers, in slices of about a millisecond. Fairness goes by
// processor time, and by who causes the load: an account for each token or address, however many sessions it has.
#pragma once

#include <array>
#include <atomic>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

namespace intervale {

// Any thread. Among accounts, fair share scheduling (J. Kay and P. Lauder, "A Fair Share Scheduler", 1988): the worker goes
// to the account that spent least, where what was spent counts half after kHalfLife. So whoever has just come is served
// before those who have had much. Accounts that spent the same up to a factor of two take turns. Among the sessions of
// one account, interactive work is scheduled by start-time fair queueing (P. Goyal, H. M. Vin and H. Cheng, "Start-Time
// Fair Queuing", 1996), with the processor time of a piece of work as its length; bulk work is first come, first
// served.
class FairScheduler {
  struct Waiter;
  using BulkQueue = std::list<Waiter>;
  // The order of accounts: by the power of two of what they spent, then by turns.
  struct Key {
    double power = 0;  // a whole number
    std::uint64_t turn = 0;
    friend bool operator<(const Key& a, const Key& b) { return std::tie(a.power, a.turn) < std::tie(b.power, b.turn); }
  };

 public:
  using Clock = std::chrono::steady_clock;
  using Time = Clock::duration;
  // Heavy accounts have workers of their own, as many as the others: they may run at low priority (ConnectionExecutor), and
  // nobody else waits for them.
  enum class Lane { usual, heavy };
  // interactive: a view's first milliseconds, while nothing was sent for it. bulk: all else. Interactive work goes first,
  // but leaves an eighth of the time to bulk work, so that no session starves; half of it, if its account spent more
  // than that of the bulk work; and all of it, if that is much more.
  enum class Priority { interactive, bulk };

  // What one source of load has spent, and its waiting requests. Shared by its sessions; not destroyed while there are
  // requests. Belongs to one scheduler.
  class Account {
   public:
    Account() = default;
    Account(const Account&) = delete;
    Account& operator=(const Account&) = delete;

   private:
    friend class FairScheduler;
    double level_ = -std::numeric_limits<double>::infinity();  // see add_spent()
    std::array<Key, 2> keys_;                                  // by priority, while there are such requests
    std::array<Lane, 2> lanes_{};                              // where those wait
    Time virtual_time_{0};                                     // the greatest start tag of its interactive work started so far
    std::multimap<Time, Waiter> interactive_;                  // by start tag; equal tags in order of arrival
    BulkQueue bulk_;
    std::atomic<bool> is_heavy_{false};
  };

  // The scheduler's state of one session, which owns it. Not moved or destroyed between async_acquire() and release().
  class Flow {
   public:
    explicit Flow(std::shared_ptr<Account> account) : account_(std::move(account)) {}
    Flow(const Flow&) = delete;
    Flow& operator=(const Flow&) = delete;

   private:
    friend class FairScheduler;
    std::shared_ptr<Account> account_;  // not null
    Time finish_tag_{0};                // the account's virtual time at which its interactive work so far is finished
    std::optional<BulkQueue::iterator> bulk_position_;
  };

  // workers: in each lane.
  explicit FairScheduler(unsigned workers) : lanes_{{{.idle_workers = workers}, {.idle_workers = workers}}} {}
  FairScheduler(const FairScheduler&) = delete;
  FairScheduler& operator=(const FairScheduler&) = delete;

  // Completes with void(Lane), on the handler's executor, once a worker of that lane is assigned to the session. The
  // session then computes for about a millisecond and calls release(), without waiting for anything in between. A flow has
  // at most one bulk request outstanding.
  template <class Token>
  auto async_acquire(Flow& flow, Priority priority, Token&& token) {
    return boost::asio::async_initiate<Token, void(Lane)>(
        [this, &flow, priority](auto handler) {
          const auto shared = std::make_shared<decltype(handler)>(std::move(handler));
          submit(flow, priority, [shared](Lane lane) {
            const auto executor = boost::asio::get_associated_executor(*shared);
            boost::asio::post(executor, [handler = std::move(*shared), lane]() mutable { std::move(handler)(lane); });
          });
        },
        token);
  }
  // Returns the worker. priority, time: of the work that was done, which whoever ran it charges.
  void release(Flow& flow, Lane lane, Priority priority, Time time, Clock::time_point now = Clock::now());

  // Makes a waiting bulk request of the flow interactive. Does nothing if there is none.
  void promote(Flow& flow);

  // What the account spent lately.
  [[nodiscard]] Time spent(const Account& account, Clock::time_point now = Clock::now()) const;
  // Adds processor time, whether of a worker of the scheduler or not.
  void charge(Account& account, Time time, Clock::time_point now = Clock::now());
  // When it was charged last, the account had spent a second or more, and four times as much as another one that was
  // charged within a second.
  [[nodiscard]] static bool is_heavy(const Account& account) { return account.is_heavy_.load(std::memory_order_relaxed); }

  [[nodiscard]] bool has_waiters() const;
  [[nodiscard]] bool has_waiters(Lane lane) const;

  // Destroys the handlers of all waiting requests. No thread may hold a worker.
  void clear();

  static constexpr std::chrono::seconds kHalfLife{30};

 private:
  using Resume = std::function<void(Lane)>;
  struct Waiter {
    Flow* flow = nullptr;
    Resume resume;
  };
  static constexpr int kInteractiveShare = 7;  // of eight parts
  static constexpr Time kMaxBalance{std::chrono::milliseconds(20)};
  // Seconds; less does not count when accounts are compared: for their order, and for whether one is heavy.
  static constexpr double kLittle = 1.0 / 64, kSome = 1.0 / 4;
  static constexpr double kMuchMore = 8, kHeavy = 4;  // times
  static constexpr std::chrono::milliseconds kLately{500};
  using Waiting = std::map<Key, Account*>;
  // Of one lane.
  struct Workers {
    unsigned idle_workers;                // while there are any, nothing waits
    std::array<Waiting, 2> waiting = {};  // accounts with waiting requests, by priority
    Time balance{0}, even_balance{0};     // time that interactive work took beyond its share, or half, within ±kMaxBalance
  };

  void add_spent(Account& account, Time time, Clock::time_point now);
  void compare(Account& account, double old_level, Clock::time_point now);
  [[nodiscard]] double level_of(double seconds, Clock::time_point now) const;
  [[nodiscard]] Key key(const Account& account, std::uint64_t turn, Clock::time_point now) const;
  void enter(Account& account, Priority priority, Clock::time_point now);
  void leave(Account& account, Priority priority);
  static Waiter take_first(Account& account, Priority priority);
  void enqueue(Flow& flow, Priority priority, Resume resume, Clock::time_point now);
  void submit(Flow& flow, Priority priority, Resume resume);
  [[nodiscard]] std::optional<Priority> next_priority(Lane lane) const;
  [[nodiscard]] Resume take_next(Lane lane, Clock::time_point now);

  mutable std::mutex mutex_;
  const Clock::time_point start_ = Clock::now();
  std::array<Workers, 2> lanes_;
  std::uint64_t turns_ = 0;
  // Accounts that were charged in the current interval of kLately, or last in the one before, by level. Only compared:
  // they may be gone.
  std::set<std::pair<double, const Account*>> charged_lately_, charged_before_;
  Clock::time_point interval_;  // when it began
};

}  // namespace intervale
