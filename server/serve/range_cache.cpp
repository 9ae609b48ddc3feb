#include "server/serve/range_cache.h"

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

#include "server/builder/all_cores.h"

namespace intervale {
namespace {

// What estimates are kept of.
bool is_part(const IntervalVolume& volume, const ShownRanges& shown) {
  if (shown.size() != 1 || shown.front() != between_keys(volume.description().format, shown.front())) return false;
  const std::vector<ShownRange> parts = parts_of(shown.front());
  return std::find(parts.begin(), parts.end(), shown.front()) != parts.end();
}

}  // namespace

RangeCache::RangeCache(Find find, std::size_t most_bytes)
    : find_(std::move(find)), most_bytes_(most_bytes), measuring_([this](const std::stop_token& stop) { measure_all(stop); }) {}

RangeCache::Relevant RangeCache::compute(const Volume& volume, const ShownRanges& shown, Distances distances) {
  const bool is_one = shown.size() == 1;
  const std::vector<ShownRange> parts = is_one ? parts_of(shown.front()) : shown;
  std::vector<Relevant> each;
  each.reserve(parts.size());
  for (ShownRange part : parts) {
    if (distances != Distances::measured) part = between_keys(volume->description().format, part);
    each.push_back(is_one && part == shown.front() ? find_(*volume, part, distances) : get(volume, {part}, distances));
  }
  if (each.size() == 1) return each.front();
  return std::make_shared<const RelevantUpdates>(united(*volume, each, shown));
}

std::list<RangeCache::Entry>::iterator RangeCache::find_entry(const Volume& volume, const ShownRanges& shown, Distances distances) {
  return std::find_if(entries_.begin(), entries_.end(),
                      [&](const Entry& entry) { return entry.distances == distances && entry.shown == shown && entry.volume.lock() == volume; });
}

RangeCache::Relevant RangeCache::get(const Volume& volume, const ShownRanges& shown, Distances distances) {
  if (shown.size() == 1 && shown.front() == volume->description().whole()) return {volume, &volume->relevant()};
  if (distances != Distances::measured && !is_part(*volume, shown)) return compute(volume, shown, distances);  // in a millisecond or two
  std::promise<Relevant> promise;
  std::unique_lock lock(mutex_);
  if (const auto known = find_entry(volume, shown, distances); known != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, known);
    const std::shared_future<Relevant> relevant = known->relevant;
    lock.unlock();
    return relevant.get();
  }
  const auto entry = entries_.insert(entries_.begin(), Entry{volume, shown, distances, promise.get_future().share()});
  lock.unlock();
  try {
    Relevant relevant = compute(volume, shown, distances);
    promise.set_value(relevant);
    lock.lock();
    entry->bytes = relevant->memory_bytes();
    drop_old();
    return relevant;
  } catch (...) {  // out of memory: whoever asks next tries again
    promise.set_exception(std::current_exception());
    lock.lock();
    entries_.erase(entry);
    throw;
  }
}

// Drops what was used least recently, and what belongs to data sets that are served no more.
void RangeCache::drop_old() {
  std::size_t bytes = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    bytes += entry->bytes;
    const bool is_computed = entry->bytes != 0, is_first = entry == entries_.begin();
    entry = is_computed && (entry->volume.expired() || (bytes > most_bytes_ && !is_first)) ? entries_.erase(entry) : std::next(entry);
  }
}

std::shared_ptr<const RangeCache::Measurement> RangeCache::measure(const Volume& volume, const ShownRanges& shown, std::function<void()> on_ready) {
  const auto request = std::make_shared<Measurement>();
  request->volume_ = volume;
  request->shown_ = shown;
  request->on_ready_ = std::move(on_ready);
  std::unique_lock lock(mutex_);
  const auto known = find_entry(volume, shown, Distances::measured);
  if ((known != entries_.end() && known->bytes != 0) || ShownRanges{volume->description().whole()} == shown) {
    lock.unlock();
    request->promise_.set_value(get(volume, shown, Distances::measured));
    return request;
  }
  std::erase_if(requests_, [](const auto& other) { return other.expired(); });
  requests_.push_back(request);
  has_requests_.notify_one();
  return request;
}

void RangeCache::stop() {
  measuring_.request_stop();
  if (measuring_.joinable()) measuring_.join();
}

void RangeCache::measure_all(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (has_requests_.wait(lock, stop, [this] { return !requests_.empty(); }) && !stop.stop_requested()) {
    auto request = requests_.back().lock();
    requests_.pop_back();
    lock.unlock();
    if (request) {
      try {
        on_spare_cores([&] { request->promise_.set_value(get(request->volume_, request->shown_, Distances::measured)); });
      } catch (...) {
        request->promise_.set_exception(std::current_exception());
      }
      request->on_ready_();
      request.reset();
    }
    lock.lock();
  }
}

}  // namespace intervale
