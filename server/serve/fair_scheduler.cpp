#include "server/serve/fair_scheduler.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace intervale {
namespace {

FairScheduler::Lane lane_of(const FairScheduler::Account& account) {
  return FairScheduler::is_heavy(account) ? FairScheduler::Lane::heavy : FairScheduler::Lane::usual;
}

double seconds(FairScheduler::Time time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

FairScheduler::Time FairScheduler::spent(const Account& account, Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return std::chrono::duration_cast<Time>(std::chrono::duration<double>(std::exp2(account.level_ - seconds(now - start_) / seconds(kHalfLife))));
}

// The level is the logarithm of what was spent, raised by one for each half-life since the start in place of halving what
// was spent: so the order of accounts stays while they wait. With the lock held, like the following.
void FairScheduler::add_spent(Account& account, Time time, Clock::time_point now) {
  if (time <= Time(0)) return;
  const double half_lives = seconds(now - start_) / seconds(kHalfLife);
  const double old_level = account.level_;
  account.level_ = half_lives + std::log2(std::exp2(account.level_ - half_lives) + seconds(time));
  for (const std::size_t i : {0, 1}) {  // it keeps its turn
    Waiting& waiting = lanes_[std::size_t(account.lanes_[i])].waiting[i];
    const auto found = waiting.find(account.keys_[i]);
    if (found == waiting.end() || found->second != &account) continue;
    waiting.erase(found);
    waiting.emplace(account.keys_[i] = key(account, account.keys_[i].turn, now), &account);
  }
  compare(account, old_level, now);
}

// Whether the account is heavy. old_level: before it was charged.
void FairScheduler::compare(Account& account, double old_level, Clock::time_point now) {
  if (now - interval_ >= kLately) {
    charged_before_ = now - interval_ < 2 * kLately ? std::move(charged_lately_) : decltype(charged_before_)();
    charged_lately_.clear();
    interval_ = now;
  }
  for (auto* const charged : {&charged_lately_, &charged_before_}) charged->erase({old_level, &account});
  charged_lately_.emplace(account.level_, &account);
  double least = account.level_;
  if (!charged_before_.empty()) least = charged_before_.begin()->first;
  least = std::max(std::min(least, charged_lately_.begin()->first), level_of(kSome, now));
  account.is_heavy_.store(account.level_ > least + std::log2(kHeavy), std::memory_order_relaxed);
}

double FairScheduler::level_of(double spent, Clock::time_point now) const { return std::log2(spent) + seconds(now - start_) / seconds(kHalfLife); }

void FairScheduler::charge(Account& account, Time time, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  add_spent(account, time, now);
}

FairScheduler::Key FairScheduler::key(const Account& account, std::uint64_t turn, Clock::time_point now) const {
  return {std::floor(std::max(account.level_, level_of(kLittle, now))), turn};
}

// Makes the account wait behind others that spent as much.
void FairScheduler::enter(Account& account, Priority priority, Clock::time_point now) {
  const auto i = std::size_t(priority);
  account.lanes_[i] = lane_of(account);
  lanes_[std::size_t(account.lanes_[i])].waiting[i].emplace(account.keys_[i] = key(account, ++turns_, now), &account);
}

void FairScheduler::leave(Account& account, Priority priority) {
  const auto i = std::size_t(priority);
  lanes_[std::size_t(account.lanes_[i])].waiting[i].erase(account.keys_[i]);
}

void FairScheduler::enqueue(Flow& flow, Priority priority, Resume resume, Clock::time_point now) {
  Account& account = *flow.account_;
  const bool is_first = priority == Priority::interactive ? account.interactive_.empty() : account.bulk_.empty();
  if (priority == Priority::interactive) {
    account.interactive_.emplace(std::max(account.virtual_time_, flow.finish_tag_), Waiter{&flow, std::move(resume)});
  } else {
    flow.bulk_position_ = account.bulk_.insert(account.bulk_.end(), {&flow, std::move(resume)});
  }
  if (is_first) enter(account, priority, now);
}

void FairScheduler::submit(Flow& flow, Priority priority, Resume resume) {
  const Lane lane = lane_of(*flow.account_);
  {
    const std::lock_guard lock(mutex_);
    unsigned& idle = lanes_[std::size_t(lane)].idle_workers;
    if (idle == 0) return enqueue(flow, priority, std::move(resume), Clock::now());
    --idle;
    if (priority == Priority::interactive) flow.account_->virtual_time_ = std::max(flow.account_->virtual_time_, flow.finish_tag_);
  }
  resume(lane);
}

// nullopt if nothing waits.
std::optional<FairScheduler::Priority> FairScheduler::next_priority(Lane lane) const {
  const Workers& workers = lanes_[std::size_t(lane)];
  const auto& [interactive, bulk] = workers.waiting;
  if (interactive.empty()) return bulk.empty() ? std::nullopt : std::optional(Priority::bulk);
  if (bulk.empty()) return Priority::interactive;
  const double more = interactive.begin()->first.power - bulk.begin()->first.power;
  if (more > std::log2(kMuchMore)) return Priority::bulk;
  return (more > 0 ? workers.even_balance : workers.balance) <= Time(0) ? Priority::interactive : Priority::bulk;
}

FairScheduler::Waiter FairScheduler::take_first(Account& account, Priority priority) {
  if (priority == Priority::interactive) {
    auto first = account.interactive_.extract(account.interactive_.begin());
    account.virtual_time_ = std::max(account.virtual_time_, first.key());
    return std::move(first.mapped());
  }
  Waiter first = std::move(account.bulk_.front());
  account.bulk_.pop_front();
  first.flow->bulk_position_.reset();
  return first;
}

// Empty if nothing waits.
FairScheduler::Resume FairScheduler::take_next(Lane lane, Clock::time_point now) {
  const auto priority = next_priority(lane);
  if (!priority) return {};
  Account& account = *lanes_[std::size_t(lane)].waiting[std::size_t(*priority)].begin()->second;
  leave(account, *priority);
  Waiter next = take_first(account, *priority);
  if (*priority == Priority::interactive ? !account.interactive_.empty() : !account.bulk_.empty()) enter(account, *priority, now);
  return std::move(next.resume);
}

void FairScheduler::release(Flow& flow, Lane lane, Priority priority, Time time, Clock::time_point now) {
  Resume next;
  {
    const std::lock_guard lock(mutex_);
    if (priority == Priority::interactive) flow.finish_tag_ = std::max(flow.account_->virtual_time_, flow.finish_tag_) + time;
    const bool is_interactive = priority == Priority::interactive;
    Workers& workers = lanes_[std::size_t(lane)];
    workers.balance = std::clamp(workers.balance + (is_interactive ? time : -kInteractiveShare * time), -kMaxBalance, kMaxBalance);
    workers.even_balance = std::clamp(workers.even_balance + (is_interactive ? time : -time), -kMaxBalance, kMaxBalance);
    next = take_next(lane, now);
    if (!next) {
      ++workers.idle_workers;
      return;
    }
  }
  next(lane);
}

void FairScheduler::promote(Flow& flow) {
  const std::lock_guard lock(mutex_);
  if (!flow.bulk_position_) return;
  Account& account = *flow.account_;
  const BulkQueue::iterator waiting = *std::exchange(flow.bulk_position_, std::nullopt);
  Resume resume = std::move(waiting->resume);
  account.bulk_.erase(waiting);
  if (account.bulk_.empty()) leave(account, Priority::bulk);
  enqueue(flow, Priority::interactive, std::move(resume), Clock::now());
}

bool FairScheduler::has_waiters() const { return has_waiters(Lane::usual) || has_waiters(Lane::heavy); }

bool FairScheduler::has_waiters(Lane lane) const {
  const std::lock_guard lock(mutex_);
  const auto& waiting = lanes_[std::size_t(lane)].waiting;
  return std::any_of(waiting.begin(), waiting.end(), [](const Waiting& all) { return !all.empty(); });
}

void FairScheduler::clear() {
  std::vector<Waiter> waiters;  // destroyed after the lock is released: a handler may own its session, and that its account
  const std::lock_guard lock(mutex_);
  for (const Lane lane : {Lane::usual, Lane::heavy}) {
    while (const auto priority = next_priority(lane)) {
      Account& account = *lanes_[std::size_t(lane)].waiting[std::size_t(*priority)].begin()->second;
      waiters.push_back(take_first(account, *priority));
      if (*priority == Priority::interactive ? account.interactive_.empty() : account.bulk_.empty()) leave(account, *priority);
    }
  }
}

}  // namespace intervale
