#include "server/serve/turnstile.h"

#include <algorithm>

namespace intervale {

void Turnstile::queue(Account& account, Turn turn, LetIn let_in) {
  {
    const std::lock_guard lock(mutex_);
    const Time stands = std::max(clock_, account.until_);
    if (free_ == 0) {
      if (turn == Turn::answer) {
        answers_.emplace(stands, std::move(let_in));
      } else {
        account.in_more_ = more_.insert(more_.end(), {&account, std::move(let_in)});
      }
      return;
    }
    --free_;
    if (turn == Turn::answer) clock_ = stands;
  }
  let_in();
}

void Turnstile::leave(Account& account, Turn turn, Time time) {
  LetIn next;
  {
    const std::lock_guard lock(mutex_);
    if (turn == Turn::answer) account.until_ = std::max(clock_, account.until_) + time;
    ahead_ = std::clamp(ahead_ + (turn == Turn::answer ? time : -kAnswersShare * time), -kMemory, kMemory);
    if (!answers_.empty() && (more_.empty() || ahead_ <= Time(0))) {
      const auto first = answers_.begin();
      clock_ = std::max(clock_, first->first);
      next = std::move(first->second);
      answers_.erase(first);
    } else if (!more_.empty()) {
      more_.front().account->in_more_.reset();
      next = std::move(more_.front().let_in);
      more_.pop_front();
    } else {
      ++free_;
      return;
    }
  }
  next();
}

void Turnstile::hurry(Account& account) {
  const std::lock_guard lock(mutex_);
  if (!account.in_more_) return;
  const Line::iterator waiting = *std::exchange(account.in_more_, std::nullopt);
  answers_.emplace(std::max(clock_, account.until_), std::move(waiting->let_in));
  more_.erase(waiting);
}

bool Turnstile::crowded() const {
  const std::lock_guard lock(mutex_);
  return !answers_.empty() || !more_.empty();
}

void Turnstile::clear() {
  std::multimap<Time, LetIn> answers;  // destroyed outside the lock: with a handler may go its session
  Line more;
  const std::lock_guard lock(mutex_);
  for (const Waiter& waiter : more_) waiter.account->in_more_.reset();
  answers.swap(answers_);
  more.swap(more_);
}

}  // namespace intervale
