#include "server/serve/range_cache.h"

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

namespace intervale {

RangeCache::Relevant RangeCache::compute(const Volume& volume, const ShownRanges& shown) {
  if (shown.size() == 1) return find_(volume, shown.front());
  std::vector<Relevant> each;
  each.reserve(shown.size());
  for (const ShownRange& one : shown) each.push_back(get(volume, {one}));
  return std::make_shared<const RelevantUpdates>(united(*volume, each));
}

RangeCache::Relevant RangeCache::get(const Volume& volume, const ShownRanges& shown) {
  if (shown.size() == 1 && shown.front() == volume->description().whole()) return {volume, &volume->relevant()};
  std::promise<Relevant> promise;
  std::unique_lock lock(mutex_);
  const auto known =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.shown == shown && entry.volume.lock() == volume; });
  if (known != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, known);
    const std::shared_future<Relevant> relevant = known->relevant;
    lock.unlock();
    return relevant.get();
  }
  const auto entry = entries_.insert(entries_.begin(), Entry{volume, shown, promise.get_future().share()});
  lock.unlock();
  try {
    Relevant relevant = compute(volume, shown);
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

}  // namespace intervale
