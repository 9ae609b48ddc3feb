#include "server/serve/background.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/serve/thread_time.h"

namespace intervale {
namespace {

using namespace std::chrono_literals;
using Account = FairScheduler::Account;

// What was done, in order; from any thread.
class Record {
 public:
  void add(const std::string& name) {
    const std::lock_guard lock(mutex_);
    names_.push_back(name);
  }
  [[nodiscard]] std::vector<std::string> names() const {
    const std::lock_guard lock(mutex_);
    return names_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> names_;
};

class BackgroundTest : public ::testing::Test {
 protected:
  // Works in that many slices.
  Background::Slice slices(const std::string& name, int count) {
    return [this, name, left = count](Memory::Share&) mutable {
      record_.add(name);
      return --left > 0;
    };
  }
  // Keeps one thread busy until it is released, so that what is submitted meanwhile waits.
  void occupy(Background& background) {
    background.run(
        std::make_shared<Account>(),
        [this](Memory::Share&) {
          started_.set_value();
          released_.wait();
          return false;
        },
        [] {});
    started_.get_future().wait();
  }
  void finish(unsigned done) const {
    for (int i = 0; i < 10000 && done_ < done; ++i) std::this_thread::sleep_for(1ms);
    ASSERT_EQ(done_, done);
  }
  std::function<void()> on_done() {
    return [this] { ++done_; };
  }

  Memory memory_;
  FairScheduler scheduler_{1};
  std::promise<void> started_, release_;
  std::shared_future<void> released_{release_.get_future()};
  Record record_;
  std::atomic<unsigned> done_{0};
};

TEST_F(BackgroundTest, AnAccountsWorkIsDoneOneByOneInOrderOfArrival) {
  Background background(scheduler_, memory_, 4);
  const auto account = std::make_shared<Account>();
  for (const char* const name : {"a", "b", "c"}) background.run(account, slices(name, 3), on_done());
  finish(3);
  EXPECT_EQ(record_.names(), (std::vector<std::string>{"a", "a", "a", "b", "b", "b", "c", "c", "c"}));
}

TEST_F(BackgroundTest, WhoSpentLeastGoesFirst) {
  Background background(scheduler_, memory_, 1);
  occupy(background);
  const auto spender = std::make_shared<Account>(), guest = std::make_shared<Account>();
  scheduler_.charge(*spender, 100s);
  background.run(spender, slices("spender", 2), on_done());
  background.run(guest, slices("guest", 2), on_done());
  release_.set_value();
  finish(2);
  EXPECT_EQ(record_.names(), (std::vector<std::string>{"guest", "guest", "spender", "spender"}));
}

TEST_F(BackgroundTest, EverySliceIsPaidFor) {
  Background background(scheduler_, memory_, 1);
  const auto account = std::make_shared<Account>();
  background.run(
      account,
      [left = 3](Memory::Share&) mutable {
        for (const auto since = thread_time(); thread_time() - since < 5ms;) {
        }
        return --left > 0;
      },
      on_done());
  finish(1);
  EXPECT_GE(scheduler_.spent(*account), 14ms);
}

TEST_F(BackgroundTest, MemoryCountsAsLongAsTheWorkIsUnderWay) {
  Background background(scheduler_, memory_, 1);
  background.run(
      std::make_shared<Account>(),
      [this, is_first = true](Memory::Share& held) mutable {
        if (is_first) {
          held.resize(1000);
          started_.set_value();
          released_.wait();
        }
        return std::exchange(is_first, false);
      },
      on_done());
  started_.get_future().wait();
  EXPECT_EQ(memory_.bytes(Memory::Holder::sessions), 1000u);
  release_.set_value();
  finish(1);
  EXPECT_EQ(memory_.bytes(), 0u);
}

TEST_F(BackgroundTest, BeginsNoSliceAfterItWasStopped) {
  Background background(scheduler_, memory_, 2);
  background.run(
      std::make_shared<Account>(),
      [this](Memory::Share&) {
        record_.add("slice");
        return true;
      },
      on_done());
  while (record_.names().empty()) std::this_thread::sleep_for(1ms);
  background.stop();
  const std::size_t done = record_.names().size();
  std::this_thread::sleep_for(5ms);
  EXPECT_EQ(record_.names().size(), done);
  EXPECT_EQ(done_, 0u);
}

}  // namespace
}  // namespace intervale
