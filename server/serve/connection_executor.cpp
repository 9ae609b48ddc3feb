#include "server/serve/connection_executor.h"

#include <boost/asio/executor_work_guard.hpp>

#include "common/parallel/all_cores.h"
#include "server/serve/thread_time.h"

namespace intervale {

void ConnectionPayer::set(std::shared_ptr<FairScheduler::Account> account) {
  account_ = accounts_.emplace_back(std::move(account)).get();  // the one before may be in use by a Charge
}

boost::asio::io_context& ConnectionPayer::chosen() const {
  const FairScheduler::Account* const account = account_;
  return account != nullptr && FairScheduler::is_heavy(*account) ? low_ : io_;
}

ConnectionPayer::Charge::Charge(const ConnectionPayer& payer) : payer_(payer), since_(thread_time()) {}

ConnectionPayer::Charge::~Charge() {
  if (FairScheduler::Account* const account = payer_.account_) payer_.scheduler_.charge(*account, thread_time() - since_);
}

void ConnectionThreads::start(unsigned count) {
  threads_.reserve(2 * std::size_t(count));
  for (unsigned i = 0; i < count; ++i) {
    threads_.emplace_back([this, work = boost::asio::make_work_guard(io_)] { io_.run(); });
    threads_.emplace_back([this, work = boost::asio::make_work_guard(low_)] {
      yield_to_other_threads();
      low_.run();
    });
  }
}

void ConnectionThreads::stop() {
  io_.stop();
  low_.stop();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

}  // namespace intervale
