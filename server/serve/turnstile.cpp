#include "server/serve/turnstile.h"

#include <algorithm>

namespace intervale {

void Turnstile::begin_answer(Account& account, Time stands) {
  clock_ = std::max(clock_, stands);
  if (!account.long_) return;
  ++account.long_inside_;
  ++long_inside_;
}

void Turnstile::queue(Account& account, Turn turn, LetIn let_in) {
  {
    const std::lock_guard lock(mutex_);
    const Time stands = std::max(clock_, account.until_);
    if (turn == Turn::answer && (free_ == 0 || !fits(account))) {
      answers_.emplace(stands, Waiter{&account, std::move(let_in)});
      return;
    }
    if (free_ == 0) {
      account.in_more_ = more_.insert(more_.end(), {&account, std::move(let_in)});
      return;
    }
    --free_;
    if (turn == Turn::answer) begin_answer(account, stands);
  }
  let_in();
}

void Turnstile::leave(Account& account, Turn turn, Time time) {
  LetIn next;
  {
    const std::lock_guard lock(mutex_);
    if (turn == Turn::answer) {
      account.until_ = std::max(clock_, account.until_) + time;
      account.long_ = time >= kLong;
      if (account.long_inside_ > 0) {
        --account.long_inside_;
        --long_inside_;
      }
    }
    ahead_ = std::clamp(ahead_ + (turn == Turn::answer ? time : -kAnswersShare * time), -kMemory, kMemory);
    const auto answer = std::find_if(answers_.begin(), answers_.end(), [this](const auto& waiting) { return fits(*waiting.second.account); });
    if (answer != answers_.end() && (more_.empty() || ahead_ <= Time(0))) {
      begin_answer(*answer->second.account, answer->first);
      next = std::move(answer->second.let_in);
      answers_.erase(answer);
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
  answers_.emplace(std::max(clock_, account.until_), std::move(*waiting));
  more_.erase(waiting);
}

bool Turnstile::crowded() const {
  const std::lock_guard lock(mutex_);
  return !answers_.empty() || !more_.empty();
}

void Turnstile::clear() {
  Answers answers;  // destroyed outside the lock: with a handler may go its session
  Line more;
  const std::lock_guard lock(mutex_);
  for (const Waiter& waiter : more_) waiter.account->in_more_.reset();
  answers.swap(answers_);
  more.swap(more_);
}

}  // namespace intervale
