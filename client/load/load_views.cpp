#include "client/load/load_views.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace intervale {
namespace {

double milliseconds(LoadClock::duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

void LoadViews::begin(Time now) {
  first_ = now;
  ++stats_.views;
  if (is_only_one()) pending_.push_back({now});
}

LoadViews::Time LoadViews::next_due() const {
  if (is_only_one() || over_) return Time::max();
  const std::chrono::duration<double> after(double(view_ + 1) / path_.views_per_second);
  return first_ + std::chrono::duration_cast<LoadClock::duration>(after);
}

bool LoadViews::advance(Time now) {
  if (next_due() > now) return false;
  for (Time due = next_due(); due <= now; due = next_due()) {
    ++view_;
    ++stats_.views;
    if (now - due > kLate) ++stats_.late_views;
    pending_.push_back({due});
  }
  is_complete_ = false;
  return true;
}

void LoadViews::asked(std::uint64_t epoch) {
  epoch_ = epoch;
  for (Pending& view : pending_) view.epoch = std::min(view.epoch, epoch);
}

void LoadViews::note_bytes(std::size_t bytes) {
  for (Pending& view : pending_) view.stale_bytes += bytes;
}

void LoadViews::serve(std::uint64_t epoch, Time now) {
  if (lost_at_) stats_.resume_ms.push_back(milliseconds(now - *std::exchange(lost_at_, {})));
  for (; !pending_.empty() && pending_.front().epoch <= epoch; pending_.pop_front()) {
    stats_.view_change_ms.push_back(milliseconds(now - pending_.front().due));
    // The first one replaces none.
    if (!is_only_one()) stats_.stale_bytes.push_back(double(pending_.front().stale_bytes));
  }
}

void LoadViews::finish(std::uint64_t epoch, bool is_all, Time now) {
  ++stats_.done_views;
  has_mesh_ = true;  // if it is empty now, it stays so
  is_complete_ = is_all && epoch == epoch_;
  serve(epoch, now);
}

void LoadViews::note_mesh(std::uint64_t bytes, Time now) {
  if (std::exchange(has_mesh_, true)) return;
  stats_.first_mesh_ms.push_back(milliseconds(now - start_));
  stats_.first_mesh_bytes.push_back(double(bytes));
}

void LoadViews::lose(Time now) {
  if (!lost_at_) lost_at_ = now;
  is_complete_ = false;
}

void LoadViews::report_rest(bool failed, Time now) {
  stats_.unanswered_views += pending_.size();
  if (failed) return;
  if (is_complete_) ++stats_.complete;
  if (!has_mesh_) stats_.first_mesh_ms.push_back(milliseconds(now - start_));
  if (!pending_.empty() || lost_at_) serve(UINT64_MAX, now);
}

}  // namespace intervale
