#include "server/serve/connection_executor.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <chrono>
#include <future>
#include <memory>
#include <vector>

namespace intervale {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;
using Account = FairScheduler::Account;

// Of the calling thread: 0, or greater if others go first.
int niceness() { return ::getpriority(PRIO_PROCESS, id_t(::gettid())); }

class ConnectionExecutorTest : public ::testing::Test {
 protected:
  ConnectionExecutorTest() { threads_.start(2); }
  // What the function returns on that executor.
  template <class Function>
  auto result_of(const asio::any_io_executor& executor, Function function) {
    std::packaged_task<decltype(function())()> task(function);
    auto future = task.get_future();
    asio::post(executor, std::move(task));
    return future.get();
  }
  asio::any_io_executor executor_of(const std::shared_ptr<Account>& account) {
    auto payer = threads_.make_payer();
    if (account) payer->set(account);
    return asio::make_strand(ConnectionExecutor(std::move(payer)));
  }

  FairScheduler scheduler_{2};
  std::shared_ptr<Account> light_ = std::make_shared<Account>(), heavy_ = std::make_shared<Account>();
  ConnectionThreads threads_{scheduler_};
};

TEST_F(ConnectionExecutorTest, HandlersOfAHeavyAccountYieldToOthers) {
  const int usual = niceness();
  const asio::any_io_executor light = executor_of(light_), heavy = executor_of(heavy_), nobodys = executor_of(nullptr);
  scheduler_.charge(*heavy_, std::chrono::seconds(5));
  EXPECT_EQ(result_of(heavy, niceness), usual) << "nobody else is there";
  scheduler_.charge(*light_, milliseconds(1));
  scheduler_.charge(*heavy_, milliseconds(1));
  EXPECT_GT(result_of(heavy, niceness), usual);
  EXPECT_EQ(result_of(light, niceness), usual);
  EXPECT_EQ(result_of(nobodys, niceness), usual);
}

TEST_F(ConnectionExecutorTest, TheAccountPaysForProcessorTime) {
  const auto work = [](milliseconds time) {
    return [time] {
      const timespec asleep{0, 20'000'000};
      ::nanosleep(&asleep, nullptr);  // costs nothing
      for (const auto until = FairScheduler::Clock::now() + time; FairScheduler::Clock::now() < until;) {
      }
      return 0;
    };
  };
  const asio::any_io_executor executor = executor_of(light_);
  result_of(executor, work(milliseconds(5)));
  threads_.stop();  // the result comes before the charge
  EXPECT_GT(scheduler_.spent(*light_), FairScheduler::Time(0));
  EXPECT_LT(scheduler_.spent(*light_), milliseconds(15));
  EXPECT_EQ(scheduler_.spent(*heavy_), FairScheduler::Time(0));
}

TEST_F(ConnectionExecutorTest, AConnectionMayFindItsPayerLater) {
  auto payer = threads_.make_payer();
  const asio::any_io_executor executor = asio::make_strand(ConnectionExecutor(payer));
  EXPECT_EQ(result_of(executor, [&] { return payer->set(heavy_), 1; }), 1);
  EXPECT_EQ(result_of(executor, [&] { return payer->set(light_), 2; }), 2);
  threads_.stop();  // the result comes before the charge
  EXPECT_GT(scheduler_.spent(*light_), FairScheduler::Time(0));
}

// As Asio's own executors do.
TEST_F(ConnectionExecutorTest, AStrandRunsOneHandlerAtATime) {
  const asio::any_io_executor executor = executor_of(light_);
  int inside = 0, most = 0, done = 0;
  std::promise<void> all;
  for (int i = 0; i < 1000; ++i) {
    asio::post(executor, [&] {
      most = std::max(most, ++inside);
      --inside;
      if (++done == 1000) all.set_value();
    });
    if (i == 500) scheduler_.charge(*light_, std::chrono::seconds(10));  // it changes its threads on the way
  }
  all.get_future().wait();
  EXPECT_EQ(most, 1);
  asio::steady_timer timer(executor, milliseconds(1));
  std::promise<void> expired;
  timer.async_wait([&](const auto&) { expired.set_value(); });
  expired.get_future().wait();
}

}  // namespace
}  // namespace intervale
