#include "server/serve/fair_scheduler.h"

#include <algorithm>

namespace intervale {

void FairScheduler::start_interactive(Flow& flow, Time start_tag) {
  virtual_time_ = std::max(virtual_time_, start_tag);
  if (!flow.is_long_) return;
  ++flow.long_running_;
  ++long_running_;
}

void FairScheduler::submit(Flow& flow, Priority priority, Resume resume) {
  {
    const std::lock_guard lock(mutex_);
    const Time start_tag = std::max(virtual_time_, flow.finish_tag_);
    if (priority == Priority::interactive && (idle_workers_ == 0 || !may_start(flow))) {
      interactive_.emplace(start_tag, Waiter{&flow, std::move(resume)});
      return;
    }
    if (idle_workers_ == 0) {
      flow.bulk_position_ = bulk_.insert(bulk_.end(), {&flow, std::move(resume)});
      return;
    }
    --idle_workers_;
    if (priority == Priority::interactive) start_interactive(flow, start_tag);
  }
  resume();
}

void FairScheduler::release(Flow& flow, Priority priority, Time time) {
  Resume next;
  {
    const std::lock_guard lock(mutex_);
    if (priority == Priority::interactive) {
      flow.finish_tag_ = std::max(virtual_time_, flow.finish_tag_) + time;
      flow.is_long_ = time >= kLongWork;
      if (flow.long_running_ > 0) {
        --flow.long_running_;
        --long_running_;
      }
    }
    balance_ = std::clamp(balance_ + (priority == Priority::interactive ? time : -kInteractiveShare * time), -kMaxBalance, kMaxBalance);
    const auto first = std::find_if(interactive_.begin(), interactive_.end(), [this](const auto& entry) { return may_start(*entry.second.flow); });
    if (first != interactive_.end() && (bulk_.empty() || balance_ <= Time(0))) {
      start_interactive(*first->second.flow, first->first);
      next = std::move(first->second.resume);
      interactive_.erase(first);
    } else if (!bulk_.empty()) {
      bulk_.front().flow->bulk_position_.reset();
      next = std::move(bulk_.front().resume);
      bulk_.pop_front();
    } else {
      ++idle_workers_;
      return;
    }
  }
  next();
}

void FairScheduler::promote(Flow& flow) {
  const std::lock_guard lock(mutex_);
  if (!flow.bulk_position_) return;
  const BulkQueue::iterator waiting = *std::exchange(flow.bulk_position_, std::nullopt);
  interactive_.emplace(std::max(virtual_time_, flow.finish_tag_), std::move(*waiting));
  bulk_.erase(waiting);
}

bool FairScheduler::has_waiters() const {
  const std::lock_guard lock(mutex_);
  return !interactive_.empty() || !bulk_.empty();
}

void FairScheduler::clear() {
  InteractiveQueue interactive;  // destroyed after the lock is released: a handler may own its session
  BulkQueue bulk;
  const std::lock_guard lock(mutex_);
  for (const Waiter& waiter : bulk_) waiter.flow->bulk_position_.reset();
  interactive.swap(interactive_);
  bulk.swap(bulk_);
}

}  // namespace intervale
