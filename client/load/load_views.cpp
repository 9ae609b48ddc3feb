#include "client/load/load_views.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "client/load/range_path.h"

namespace intervale {
namespace {

double milliseconds(LoadClock::duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

void LoadViews::begin(Time now, Time end) {
  first_ = now;
  end_ = end;
  ++stats_.views;
  if (is_only_one()) open_.push_back({now});
}

LoadViews::Time LoadViews::next_due() const {
  if (is_only_one() || over_) return Time::max();
  const double rests = path_.scenario == Scenario::range ? rests_before(view_ + 1) : 0;
  const std::chrono::duration<double> after(double(view_ + 1) / path_.views_per_second + rests);
  const Time due = first_ + std::chrono::duration_cast<LoadClock::duration>(after);
  return due < end_ ? due : Time::max();
}

bool LoadViews::advance(Time now) {
  if (next_due() > now) return false;
  for (Time due = next_due(); due <= now; due = next_due()) {
    ++view_;
    ++stats_.views;
    if (now - due > kLate) ++stats_.late_views;
    open_.push_back({due});
  }
  is_complete_ = false;
  return true;
}

void LoadViews::asked(std::uint64_t epoch) {
  if (first_epoch_ == 0) first_epoch_ = epoch;
  asked_.push_back(epoch);
  for (Open& view : open_) view.epoch = std::min(view.epoch, epoch);
}

void LoadViews::note_bytes(std::size_t bytes) {
  served_->bytes += bytes;
  for (std::size_t i = answered_; i < open_.size(); ++i) open_[i].stale_bytes += bytes;
}

void LoadViews::serve(std::uint64_t epoch, Time now) {
  if (const auto first = first_epoch_of(epoch); !served_ || served_->epoch != first) {
    count_bytes();
    served_ = {first};
  }
  answer(epoch, now);
}

std::uint64_t LoadViews::first_epoch_of(std::uint64_t epoch) {
  while (asked_.size() > 1 && asked_[1] <= epoch) asked_.pop_front();
  return asked_.front();
}

void LoadViews::answer(std::uint64_t epoch, Time now) {
  if (lost_at_) stats_.resume_ms.push_back(milliseconds(now - *std::exchange(lost_at_, {})));
  for (; answered_ < open_.size() && open_[answered_].epoch <= epoch; ++answered_) {
    stats_.view_change_ms.push_back(milliseconds(now - open_[answered_].due));
    // The first one replaces none.
    if (!is_only_one()) stats_.stale_bytes.push_back(double(open_[answered_].stale_bytes));
  }
}

void LoadViews::finish(std::uint64_t epoch, bool is_all, Time now) {
  has_mesh_ = true;  // if it is empty now, it stays so
  serve(epoch, now);
  is_complete_ = is_all && asked_.size() == 1;
  // A view that is sent again while its Done is under way has a second one.
  if (!std::exchange(served_->is_done, true)) ++stats_.done_views;
  for (; !open_.empty() && open_.front().epoch <= epoch; open_.pop_front(), --answered_) {
    stats_.view_done_ms.push_back(milliseconds(now - open_.front().due));
  }
}

// Of the view served last. What a client's first view brings is no change.
void LoadViews::count_bytes() {
  if (served_ && (is_only_one() || served_->epoch != first_epoch_)) stats_.view_bytes.push_back(double(served_->bytes));
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
  stats_.unanswered_views += open_.size() - answered_;
  if (failed) return;
  count_bytes();
  if (is_complete_) ++stats_.complete;
  if (!has_mesh_) stats_.first_mesh_ms.push_back(milliseconds(now - start_));
  if (answered_ < open_.size() || lost_at_) answer(UINT64_MAX, now);
  for (const Open& view : open_) stats_.view_done_ms.push_back(milliseconds(now - view.due));
}

}  // namespace intervale
