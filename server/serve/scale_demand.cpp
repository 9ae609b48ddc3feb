#include "server/serve/scale_demand.h"

#include <algorithm>

namespace intervale {

ScaleDemand::Use::Use(ScaleDemand& demand, std::string name) : demand_(demand), name_(std::move(name)) {
  const std::lock_guard lock(demand_.mutex_);
  ++demand_.entries_[name_].sessions;
}

ScaleDemand::Use::~Use() {
  const std::lock_guard lock(demand_.mutex_);
  demand_.forget(wanted_);
  Entry& entry = demand_.entries_.at(name_);
  --entry.sessions;
  entry.last_use = Clock::now();
}

bool ScaleDemand::Use::want(const IntervalVolume* held, Clock::time_point now) {
  if (held == nullptr && wanted_ == nullptr) return true;
  const std::lock_guard lock(demand_.mutex_);
  Entry& entry = demand_.entries_.at(name_);
  const bool is_refused = held != nullptr && entry.refuses(*held) && now < entry.refused_until;
  if (is_refused) {
    held = nullptr;
  } else if (held != nullptr) {
    entry.refused_until = {};
  }
  if (held != wanted_) {
    demand_.forget(wanted_);
    wanted_ = held;
    if (held != nullptr) {
      ++demand_.wanted_[held];
      demand_.wake_();
    }
  }
  return !is_refused;
}

void ScaleDemand::forget(const IntervalVolume* wanted) {
  const auto found = wanted_.find(wanted);
  if (found != wanted_.end() && --found->second == 0) wanted_.erase(found);
}

bool ScaleDemand::Entry::refuses(const IntervalVolume& held) const {
  return refusals > 0 && contents == held.description().content_hash && updates == held.size();
}

bool ScaleDemand::is_wanted(const IntervalVolume& held, Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  if (!wanted_.contains(&held)) return false;
  const auto found = entries_.find(held.description().name);
  return found == entries_.end() || !found->second.refuses(held) || now >= found->second.refused_until;
}

void ScaleDemand::refuse(const IntervalVolume& held, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[held.description().name];
  entry.refusals = entry.refuses(held) ? entry.refusals + 1 : 1;
  entry.contents = held.description().content_hash;
  entry.updates = held.size();
  const unsigned doublings = std::min(entry.refusals - 1, 8U);
  entry.refused_until = now + std::min(kRetry * (1 << doublings), kLongestRetry);
}

bool ScaleDemand::is_idle(const std::string& name, Clock::duration time, Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(name);
  return found == entries_.end() || (found->second.sessions == 0 && now >= found->second.last_use + time);
}

}  // namespace intervale
