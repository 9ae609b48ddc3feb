// Where the handlers of connections run, and who pays for them. Internal to server/serve: brings in Asio.
#pragma once

#include <atomic>
#include <boost/asio/execution.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/smart_ptr/intrusive_ptr.hpp>
#include <memory>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "server/scratch/scratch_memory.h"
#include "server/serve/fair_scheduler.h"

namespace intervale {

// The account that pays for a connection: at first its address's, later perhaps its token's. set() on one thread at a
// time; the rest on any thread. Owned by its executors and connections.
class ConnectionPayer {
 public:
  // scheduler: of the accounts. It and the contexts outlive this. io: of the server's threads. low: of threads of low
  // priority.
  ConnectionPayer(FairScheduler& scheduler, boost::asio::io_context& io, boost::asio::io_context& low) : scheduler_(scheduler), io_(io), low_(low) {}

  // Before that nobody pays.
  void set(std::shared_ptr<FairScheduler::Account> account);

  [[nodiscard]] boost::asio::io_context& io() const { return io_; }
  friend void intrusive_ptr_add_ref(ConnectionPayer* payer) { payer->owners_.fetch_add(1, std::memory_order_relaxed); }
  friend void intrusive_ptr_release(ConnectionPayer* payer) {
    if (payer->owners_.fetch_sub(1, std::memory_order_acq_rel) == 1) delete payer;
  }

  // Where the next handler is to run.
  [[nodiscard]] boost::asio::io_context& chosen() const;
  // Charges the processor time of the calling thread while it exists.
  class Charge {
   public:
    explicit Charge(const ConnectionPayer& payer);
    Charge(const Charge&) = delete;
    Charge& operator=(const Charge&) = delete;
    ~Charge();

   private:
    const ConnectionPayer& payer_;
    FairScheduler::Time since_;
  };

 private:
  FairScheduler& scheduler_;
  boost::asio::io_context& io_;
  boost::asio::io_context& low_;
  std::atomic<long> owners_{0};
  std::atomic<FairScheduler::Account*> account_{nullptr};          // the last one of:
  std::vector<std::shared_ptr<FairScheduler::Account>> accounts_;  // two at most
};

using ConnectionPayerPtr = boost::intrusive_ptr<ConnectionPayer>;

// An executor of Asio: runs all handlers of one connection, on the server's threads or, while its account is heavy, on
// those of low priority. So all that an account causes yields to others, not only what is scheduled. Like io_context's
// own, it runs a handler at once if the calling thread is one of those and the caller allows it. Has the size of a
// pointer, so that an any_io_executor holds a strand of it without allocation.
template <bool kMayRunAtOnce>
class BasicConnectionExecutor {
 public:
  explicit BasicConnectionExecutor(ConnectionPayerPtr payer) : payer_(std::move(payer)) {}
  BasicConnectionExecutor(const BasicConnectionExecutor& other) noexcept : payer_(other.payer_) {}  // intrusive_ptr does not say so
  BasicConnectionExecutor(BasicConnectionExecutor&&) noexcept = default;
  BasicConnectionExecutor& operator=(const BasicConnectionExecutor&) noexcept = default;
  BasicConnectionExecutor& operator=(BasicConnectionExecutor&&) noexcept = default;
  ~BasicConnectionExecutor() = default;

  template <class Function>
  void execute(Function&& function) const {
    const auto executor = boost::asio::require(payer_->chosen().get_executor(), kBlocking);
    executor.execute([payer = payer_, run = std::decay_t<Function>(std::forward<Function>(function))]() mutable {
      const ConnectionPayer::Charge charge(*payer);
      const ScratchMemory::Reading data_sets;
      std::move(run)();
    });
  }

  [[nodiscard]] boost::asio::execution_context& query(boost::asio::execution::context_t /*property*/) const noexcept { return payer_->io(); }
  static constexpr boost::asio::execution::blocking_t query(boost::asio::execution::blocking_t /*property*/) noexcept { return kBlocking; }
  [[nodiscard]] auto require(boost::asio::execution::blocking_t::never_t /*property*/) const { return BasicConnectionExecutor<false>(payer_); }
  [[nodiscard]] auto require(boost::asio::execution::blocking_t::possibly_t /*property*/) const { return BasicConnectionExecutor<true>(payer_); }
  friend bool operator==(const BasicConnectionExecutor& a, const BasicConnectionExecutor& b) noexcept { return a.payer_ == b.payer_; }
  friend bool operator!=(const BasicConnectionExecutor& a, const BasicConnectionExecutor& b) noexcept { return a.payer_ != b.payer_; }

 private:
  static constexpr std::conditional_t<kMayRunAtOnce, boost::asio::execution::blocking_t::possibly_t, boost::asio::execution::blocking_t::never_t>
      kBlocking{};
  ConnectionPayerPtr payer_;
};
using ConnectionExecutor = BasicConnectionExecutor<true>;

// Threads that run connections, and as many of low priority.
class ConnectionThreads {
 public:
  explicit ConnectionThreads(FairScheduler& scheduler) : scheduler_(scheduler) {}
  ConnectionThreads(const ConnectionThreads&) = delete;
  ConnectionThreads& operator=(const ConnectionThreads&) = delete;
  ~ConnectionThreads() { stop(); }

  [[nodiscard]] boost::asio::io_context& io() { return io_; }
  [[nodiscard]] ConnectionPayerPtr make_payer() { return new ConnectionPayer(scheduler_, io_, low_); }

  void start(unsigned count);
  void stop();  // runs no handler any more; destroying this destroys those that wait

 private:
  FairScheduler& scheduler_;
  boost::asio::io_context io_, low_;
  std::vector<std::thread> threads_;
};

}  // namespace intervale
