// Schedules the sessions' computations on a limited number of workers. Selecting and encoding updates takes
// milliseconds, reading and writing messages microseconds: in order of arrival, a new connection would wait for the
// next batch of every other session.
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

// Any thread. Interactive work is scheduled by start-time fair queueing (P. Goyal, H. M. Vin and H. Cheng, "Start-Time
// Fair Queuing", 1996), with the measured time of a piece of work as its length: a session whose views take long to
// answer waits for the sessions whose views do not. Bulk work is first come, first served.
class FairScheduler {
  using Resume = std::function<void()>;
  struct Waiter;
  using BulkQueue = std::list<Waiter>;

 public:
  using Time = std::chrono::steady_clock::duration;
  // interactive: nothing was sent yet for the session's view. bulk: its stream continues. Interactive work goes
  // first, but leaves an eighth of the time to bulk work, so that no session starves.
  enum class Priority { interactive, bulk };

  // The scheduler's state of one session, which owns it. Not moved or destroyed between async_acquire() and release().
  class Flow {
   public:
    Flow() = default;
    Flow(const Flow&) = delete;
    Flow& operator=(const Flow&) = delete;

   private:
    friend class FairScheduler;
    Time finish_tag_{0};    // virtual time at which its interactive work so far is finished
    bool is_long_ = false;  // its last interactive work took kLongWork or more
    int long_running_ = 0;  // pieces of long work that it runs now
    std::optional<BulkQueue::iterator> bulk_position_;
  };

  explicit FairScheduler(unsigned workers) : idle_workers_(workers), long_work_limit_(workers > 1 ? workers - 1 : 1) {}
  FairScheduler(const FairScheduler&) = delete;
  FairScheduler& operator=(const FairScheduler&) = delete;

  // Completes with void(), on the handler's executor, once a worker is assigned to the session. The session then
  // computes and calls release(), without waiting for anything in between. A flow has at most one bulk request
  // outstanding. Flows whose last interactive work was long share all workers but one, if there are two or more.
  template <class Token>
  auto async_acquire(Flow& flow, Priority priority, Token&& token) {
    return boost::asio::async_initiate<Token, void()>(
        [this, &flow, priority](auto handler) {
          const auto shared = std::make_shared<decltype(handler)>(std::move(handler));
          submit(flow, priority, [shared] { boost::asio::post(boost::asio::get_associated_executor(*shared), std::move(*shared)); });
        },
        token);
  }
  // Returns the worker. priority, time: of the work that was done.
  void release(Flow& flow, Priority priority, Time time);

  // Makes a waiting bulk request of the flow interactive. Does nothing if there is none.
  void promote(Flow& flow);

  [[nodiscard]] bool has_waiters() const;

  // Destroys the handlers of all waiting requests. No thread may hold a worker.
  void clear();

 private:
  struct Waiter {
    Flow* flow = nullptr;
    Resume resume;
  };
  using InteractiveQueue = std::multimap<Time, Waiter>;
  static constexpr int kInteractiveShare = 7;  // of eight parts
  static constexpr Time kMaxBalance{std::chrono::milliseconds(20)};
  static constexpr Time kLongWork{std::chrono::milliseconds(50)};
  [[nodiscard]] bool may_start(const Flow& flow) const { return !flow.is_long_ || long_running_ < long_work_limit_; }
  void start_interactive(Flow& flow, Time start_tag);
  void submit(Flow& flow, Priority priority, Resume resume);

  mutable std::mutex mutex_;
  unsigned idle_workers_;     // while there are any, only long work that may not start waits
  unsigned long_work_limit_;  // most workers that long work may have
  unsigned long_running_ = 0;
  Time balance_{0};               // time that interactive work took beyond its share, within ±kMaxBalance
  Time virtual_time_{0};          // the greatest start tag of the interactive work started so far
  InteractiveQueue interactive_;  // by start tag; equal tags in order of arrival
  BulkQueue bulk_;
};

}  // namespace intervale
