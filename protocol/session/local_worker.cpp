#include "protocol/session/local_worker.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace intervale {

class LocalWorker::Answer : public RangeAnswer {
 public:
  Answer(std::shared_ptr<const IntervalVolume> volume, ShownRanges shown, Distances distances)
      : volume_(std::move(volume)), shown_(std::move(shown)), distances_(distances) {
    for (const ShownRange& one : shown_) {
      if (one == volume_->description().whole()) continue;
      for (const RangePart& part : parts_of(volume_->description().format, one, distances_)) parts_.push_back({part, nullptr});
    }
  }
  [[nodiscard]] bool is_ready() const override { return whole_ != nullptr; }
  [[nodiscard]] bool is_soon() const override { return is_ready(); }
  [[nodiscard]] Relevant result() const override { return whole_; }

  [[nodiscard]] const std::shared_ptr<const IntervalVolume>& volume() const { return volume_; }
  // Goes on: finds those parts that do not take long and one that does, and puts them together if that was the last.
  template <class FindOne>
  void go_on(const FindOne& find, bool may_take_long) {
    for (Found& one : parts_) {
      if (one.relevant) continue;
      one.relevant = find(one.part, may_take_long);
      if (!one.relevant) return;
      if (one.part.distances == Distances::measured) may_take_long = false;
    }
    whole_ = find_relevant_updates(volume_, shown_, distances_, [this](const RangePart& part) {
      return std::find_if(parts_.begin(), parts_.end(), [&](const Found& one) { return one.part == part; })->relevant;
    });
  }

 private:
  std::shared_ptr<const IntervalVolume> volume_;
  ShownRanges shown_;
  Distances distances_;
  std::vector<Found> parts_;
  Relevant whole_;
};

LocalWorker::~LocalWorker() = default;

// nullptr: it takes long.
RangeAnswer::Relevant LocalWorker::find(const RangePart& part, bool may_take_long) {
  const auto known = std::find_if(found_.begin(), found_.end(), [&](const Found& one) { return one.part == part; });
  if (known != found_.end()) {
    found_.splice(found_.begin(), found_, known);
    return known->relevant;
  }
  if (part.distances == Distances::measured && !may_take_long) return nullptr;
  found_.push_front({part, finder_->find(part)});
  std::size_t bytes = 0;
  for (auto one = found_.begin(); one != found_.end();) {
    bytes += one->relevant->memory_bytes();
    one = bytes > most_bytes_ && one != found_.begin() ? found_.erase(one) : std::next(one);
  }
  return found_.front().relevant;
}

void LocalWorker::go_on(Answer& answer, bool may_take_long) {
  if (volume_ != answer.volume()) {
    found_.clear();
    finder_.reset();
    volume_ = answer.volume();
    finder_.emplace(*volume_);
  }
  answer.go_on([this](const RangePart& part, bool may) { return find(part, may); }, may_take_long);
}

std::shared_ptr<const RangeAnswer> LocalWorker::ask(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown,
                                                    Distances distances) {
  auto answer = std::make_shared<Answer>(volume, shown, distances);
  go_on(*answer, false);
  if (!answer->is_ready()) asked_ = answer;
  return answer;
}

bool LocalWorker::work() {
  if (const auto search = search_.lock(); search && !search->is_done()) {
    search->go_on();
    return true;
  }
  const auto asked = asked_.lock();
  if (!asked || asked->is_ready()) return false;
  go_on(*asked, true);
  return true;
}

}  // namespace intervale
