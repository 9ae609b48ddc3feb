#include "server/serve/scale_demand.h"

#include <algorithm>

namespace intervale {

ScaleDemand::Use ScaleDemand::use(const std::string& name) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[name];
  if (entry.sessions == 0 && Clock::now() >= entry.last_use + kLinger) entry.asked = 0;
  ++entry.sessions;
  return Use(this, {name});
}

void ScaleDemand::end_use(const std::string& name) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_.at(name);
  --entry.sessions;
  entry.last_use = Clock::now();
}

bool ScaleDemand::ask(const std::string& name, std::uint64_t held, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[name];
  entry.last_use = now;
  if (entry.refused != Clock::time_point() && now < entry.refused + kRetry) return false;
  entry.refused = {};
  entry.asked = std::max(entry.asked, held + 1);
  wake_();
  return true;
}

bool ScaleDemand::is_asked(const std::string& name, std::uint64_t held, Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(name);
  if (found == entries_.end()) return false;
  const Entry& entry = found->second;
  return held < entry.asked && (entry.sessions > 0 || now < entry.last_use + kLinger);
}

void ScaleDemand::refuse(const std::string& name, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[name];
  entry.refused = now;
  entry.asked = 0;
}

bool ScaleDemand::is_idle(const std::string& name, Clock::duration time, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(name);
  if (found == entries_.end()) return true;
  Entry& entry = found->second;
  if (entry.sessions > 0 || now < entry.last_use + time) return false;
  entry.asked = 0;
  return true;
}

}  // namespace intervale
