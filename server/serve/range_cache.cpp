#include "server/serve/range_cache.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "server/builder/all_cores.h"

namespace intervale {

RangeCache::RangeCache(Find find, std::size_t most_bytes)
    : find_(std::move(find)), most_bytes_(most_bytes), measuring_([this](const std::stop_token& stop) { measure_all(stop); }) {}

// What is known of a part, or is being found; better known distances before others.
std::list<RangeCache::Entry>::iterator RangeCache::find_entry(const Volume& volume, const RangePart& part) {
  auto best = entries_.end();
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
    if (entry->part.shown != part.shown || entry->volume.lock() != volume) continue;
    if (entry->part.distances == part.distances && best == entries_.end()) best = entry;
    if (entry->part.distances > part.distances && entry->bytes != 0) best = entry;
  }
  return best;
}

RangeCache::Relevant RangeCache::get_part(PartFinder& finder, const Volume& volume, const RangePart& part) {
  std::promise<Relevant> promise;
  std::unique_lock lock(mutex_);
  if (const auto known = find_entry(volume, part); known != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, known);
    const std::shared_future<Relevant> relevant = known->relevant;
    lock.unlock();
    return relevant.get();
  }
  const auto entry = entries_.insert(entries_.begin(), Entry{volume, part, promise.get_future().share()});
  lock.unlock();
  try {
    Relevant relevant = find_(finder, part);
    promise.set_value(relevant);
    lock.lock();
    entry->bytes = relevant->memory_bytes();
    drop_old(volume, part);
    return relevant;
  } catch (...) {  // out of memory, or stopped: whoever asks next tries again
    promise.set_exception(std::current_exception());
    lock.lock();
    entries_.erase(entry);
    throw;
  }
}

// Drops what is better known by now, what was used least recently, and what belongs to data sets that are served no
// more.
void RangeCache::drop_old(const Volume& volume, const RangePart& found) {
  std::size_t bytes = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const bool is_computed = entry->bytes != 0, is_first = entry == entries_.begin();
    const bool is_worse = entry->part.distances < found.distances && entry->part.shown == found.shown && entry->volume.lock() == volume;
    bytes += is_worse ? 0 : entry->bytes;
    const bool is_old = is_worse || entry->volume.expired() || (bytes > most_bytes_ && !is_first);
    entry = is_computed && is_old ? entries_.erase(entry) : std::next(entry);
  }
}

RangeCache::Relevant RangeCache::put_together(const Volume& volume, const ShownRanges& shown, Distances distances, const FindPart& find) {
  {
    const std::lock_guard lock(mutex_);
    for (const Whole& whole : wholes_) {
      Relevant relevant = whole.relevant.lock();
      if (relevant && whole.distances >= distances && relevant->shown() == shown && whole.volume.lock() == volume) return relevant;
    }
  }
  Relevant relevant = find_relevant_updates(volume, shown, distances, find);
  const std::lock_guard lock(mutex_);
  std::erase_if(wholes_, [](const Whole& whole) { return whole.relevant.expired(); });
  wholes_.push_back({volume, distances, relevant});
  return relevant;
}

RangeCache::Relevant RangeCache::get(const Volume& volume, const ShownRanges& shown, Distances distances) {
  PartFinder finder(*volume);
  return put_together(volume, shown, distances, [&](const RangePart& part) { return get_part(finder, volume, part); });
}

std::shared_ptr<const RangeCache::Measurement> RangeCache::measure(const Volume& volume, const ShownRanges& shown, std::function<void()> on_ready) {
  auto request = std::make_shared<Measurement>();
  request->volume_ = volume;
  request->shown_ = shown;
  request->on_ready_ = std::move(on_ready);
  bool is_known = true;
  std::unique_lock lock(mutex_);
  for (const ShownRange& one : shown) {
    if (one == volume->description().whole()) continue;
    for (const RangePart& part : parts_of(volume->description().format, one, Distances::measured)) {
      const auto known = find_entry(volume, part);
      const bool is_computed = known != entries_.end() && known->bytes != 0;
      if (is_computed) entries_.splice(entries_.begin(), entries_, known);
      request->parts_.push_back({part, is_computed ? known->relevant.get() : nullptr});
      is_known = is_known && is_computed;
    }
  }
  if (is_known) {
    lock.unlock();
    answer(*request);
    return request;
  }
  std::erase_if(requests_, [](const auto& other) { return other.expired(); });
  requests_.push_back(request);
  has_requests_.notify_one();
  return request;
}

// Puts together the parts of a request, all of which are known.
void RangeCache::answer(Measurement& request) {
  const auto part_of = [&](const RangePart& part) {
    return std::find_if(request.parts_.begin(), request.parts_.end(), [&](const auto& one) { return one.part == part; })->relevant;
  };
  try {
    request.promise_.set_value(put_together(request.volume_, request.shown_, Distances::measured, part_of));
  } catch (...) {
    request.promise_.set_exception(std::current_exception());
  }
}

void RangeCache::stop() {
  measuring_.request_stop();
  if (measuring_.joinable()) measuring_.join();
}

// nullptr: there is none. With the lock held.
RangeCache::Request RangeCache::newest_request() {
  for (; !requests_.empty(); requests_.pop_back()) {
    if (Request request = requests_.back().lock()) return request;
  }
  return nullptr;
}

// Hands a part to all requests that have it; takes out those that are complete. With the lock held.
std::vector<RangeCache::Request> RangeCache::requests_with(const Volume& volume, const RangePart& part, const Relevant& relevant) {
  std::vector<Request> complete;
  std::erase_if(requests_, [&](const std::weak_ptr<Measurement>& waiting) {
    Request request = waiting.lock();
    if (!request) return true;
    if (request->volume_ != volume) return false;
    for (auto& one : request->parts_) {
      if (one.part == part) one.relevant = relevant;
    }
    if (std::any_of(request->parts_.begin(), request->parts_.end(), [](const auto& one) { return !one.relevant; })) return false;
    complete.push_back(std::move(request));
    return true;
  });
  return complete;
}

// Finds the next part that a request lacks.
void RangeCache::measure_next(PartFinder& finder, const Request& request) {
  const RangePart part = std::find_if(request->parts_.begin(), request->parts_.end(), [](const auto& one) { return !one.relevant; })->part;
  std::vector<Request> done;
  try {
    Relevant relevant;
    on_spare_cores([&] { relevant = get_part(finder, request->volume_, part); });
    {
      const std::lock_guard lock(mutex_);
      done = requests_with(request->volume_, part, relevant);
    }
    for (const Request& one : done) answer(*one);
  } catch (...) {
    request->promise_.set_exception(std::current_exception());
    const std::lock_guard lock(mutex_);
    std::erase_if(requests_, [&](const auto& other) { return other.lock() == request; });
    done.push_back(request);
  }
  for (const Request& one : done) one->on_ready_();
}

void RangeCache::measure_all(const std::stop_token& stop) {
  const ParallelFor parallel = on_all_cores_until(stop);
  Volume volume;
  std::optional<PartFinder> finder;  // of `volume`; both while there is something to measure
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const Request request = newest_request();
    if (!request || request->volume_ != volume) {
      finder.reset();
      volume.reset();
    }
    if (!request) {
      has_requests_.wait(lock, stop, [this] { return !requests_.empty(); });
      continue;
    }
    lock.unlock();
    if (!volume) finder.emplace(*(volume = request->volume_), parallel);
    measure_next(*finder, request);
    lock.lock();
  }
}

}  // namespace intervale
