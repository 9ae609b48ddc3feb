#include "server/serve/turnstile.h"

#include <algorithm>

namespace intervale {

void Turnstile::queue(Id session, Turn turn, LetIn let_in) {
  {
    const std::lock_guard lock(mutex_);
    if (free_ == 0) {
      Line& line = turn == Turn::answer ? answers_ : more_;
      line.push_back({session, std::move(let_in)});
      if (turn == Turn::more) in_more_[session] = std::prev(line.end());
      return;
    }
    --free_;
  }
  let_in();
}

void Turnstile::leave(Turn turn, Time time) {
  Line next;
  {
    const std::lock_guard lock(mutex_);
    ahead_ = std::clamp(ahead_ + (turn == Turn::answer ? time : -kAnswersShare * time), -kMemory, kMemory);
    const bool answer = !answers_.empty() && (more_.empty() || ahead_ <= Time(0));
    Line& line = answer ? answers_ : more_;
    if (line.empty()) {
      ++free_;
      return;
    }
    if (!answer) in_more_.erase(line.front().session);
    next.splice(next.end(), line, line.begin());
  }
  next.front().let_in();
}

void Turnstile::hurry(Id session) {
  const std::lock_guard lock(mutex_);
  const auto found = in_more_.find(session);
  if (found == in_more_.end()) return;
  answers_.splice(answers_.end(), more_, found->second);
  in_more_.erase(found);
}

bool Turnstile::crowded() const {
  const std::lock_guard lock(mutex_);
  return !answers_.empty() || !more_.empty();
}

void Turnstile::clear() {
  Line answers, more;  // destroyed outside the lock: with a handler may go its session
  const std::lock_guard lock(mutex_);
  answers.swap(answers_);
  more.swap(more_);
  in_more_.clear();
}

}  // namespace intervale
