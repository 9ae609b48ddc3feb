#include "server/serve/range_cache.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "common/parallel/all_cores.h"
#include "server/scratch/scratch_memory.h"

namespace intervale {
namespace {

// A hand that drags a range asks again soon: the field that was restored for it is kept so long.
constexpr std::chrono::seconds kFinderKept(5);

}  // namespace

RangeCache::RangeCache(Memory& memory, FairScheduler& scheduler, Find find, std::size_t most_bytes)
    : memory_(memory), scheduler_(scheduler), find_(std::move(find)), most_bytes_(most_bytes) {
  threads_.reserve(2);
  threads_.emplace_back([this](const std::stop_token& stop) { serve(soon_, SpareCores::Rests::no, stop); });
  threads_.emplace_back([this](const std::stop_token& stop) { serve(measuring_, SpareCores::Rests::while_sessions_wait, stop); });
}

// The same, whose memory counts as long as anybody has it: it grows.
RangeCache::Relevant RangeCache::counted(Relevant relevant) const {
  struct Counted {
    std::mutex resizing;
    Memory::Share share;
    Relevant relevant;
    Counted(Memory& memory, Relevant one) : share(memory, Memory::Holder::ranges, one->memory_bytes()), relevant(std::move(one)) {
      relevant->set_on_growth([this] {
        const std::lock_guard lock(resizing);
        share.resize(relevant->memory_bytes());
      });
    }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
    ~Counted() { relevant->set_on_growth({}); }
  };
  const auto both = std::make_shared<const Counted>(memory_, std::move(relevant));
  return {both, both->relevant.get()};
}

// What is known of a part, or is being found; better known distances before others.
RangeCache::Entries::iterator RangeCache::find_entry(const Volume& volume, const RangePart& part) {
  for (const Distances distances : {Distances::measured, Distances::estimated, Distances::none}) {
    if (distances < part.distances) break;
    const auto found = entry_of_.find(Key{volume.get(), {part.shown, distances}});
    if (found == entry_of_.end()) continue;
    const Entry& entry = *found->second;
    if (entry.is_of(volume) && (distances == part.distances || entry.bytes != 0)) return found->second;
  }
  return entries_.end();
}

// It is not found any more, but stays in the list.
void RangeCache::hide(Entries::iterator entry) {
  const auto found = entry_of_.find(entry->key);
  if (found != entry_of_.end() && found->second == entry) entry_of_.erase(found);
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
  const auto entry = entries_.insert(entries_.begin(), Entry{{volume.get(), part}, volume, promise.get_future().share()});
  entry_of_[entry->key] = entry;
  lock.unlock();
  try {
    Relevant relevant = counted(find_(finder, part));
    promise.set_value(relevant);
    lock.lock();
    entry->bytes = relevant->memory_bytes();
    const Entries dropped = take_old(volume, part);
    lock.unlock();  // what is dropped may have thousands of arrays: nobody waits until they are freed
    return relevant;
  } catch (...) {  // out of memory, or stopped: whoever asks next tries again
    promise.set_exception(std::current_exception());
    lock.lock();
    hide(entry);
    entries_.erase(entry);
    throw;
  }
}

// What is better known by now, what was used least recently of what nobody has, and what belongs to data sets that are
// served no more: taken out of the list. With the lock held.
RangeCache::Entries RangeCache::take_old(const Volume& volume, const RangePart& found) {
  constexpr std::size_t kEnds = 2;  // of a range: both stay, however large they are
  Entries old;
  std::size_t bytes = 0, newer = 0;
  for (auto entry = entries_.begin(); entry != entries_.end(); ++newer) {
    const bool is_computed = entry->bytes != 0;
    const bool is_worse = entry->key.part.distances < found.distances && entry->key.part.shown == found.shown && entry->is_of(volume);
    if (is_computed) entry->bytes = entry->relevant.get()->memory_bytes();
    bytes += is_worse ? 0 : entry->bytes;
    const bool is_in_use = is_computed && entry->relevant.get().use_count() > 1;
    const bool is_old = is_worse || entry->volume.expired() || (bytes > most_bytes_ && newer >= kEnds && !is_in_use);
    const auto next = std::next(entry);
    if (is_computed && is_old) {
      hide(entry);
      old.splice(old.end(), entries_, entry);
    }
    entry = next;
  }
  return old;
}

// A range of several parts that a session has. nullptr: there is none that finds something itself. With the lock held.
RangeCache::Relevant RangeCache::find_whole(const Volume& volume, const ShownRanges& shown, Distances distances) const {
  for (const Whole& whole : wholes_) {
    Relevant relevant = whole.relevant.lock();
    if (relevant && whole.distances >= distances && relevant->shown() == shown && whole.volume.lock() == volume) return relevant;
  }
  return nullptr;
}

RangeCache::Answer::Part* RangeCache::Answer::first_lacking() {
  const auto lacking = std::find_if(parts_.begin(), parts_.end(), [](const Part& one) { return !one.relevant; });
  return lacking == parts_.end() ? nullptr : &*lacking;
}

std::shared_ptr<const RangeCache::Answer> RangeCache::ask(const Volume& volume, const ShownRanges& shown, Distances distances, Payer payer,
                                                          std::function<void()> on_ready) {
  auto request = std::make_shared<Answer>();
  request->volume_ = volume;
  request->shown_ = shown;
  request->distances_ = distances;
  request->payer_ = std::move(payer);
  request->on_ready_ = std::move(on_ready);
  std::unique_lock lock(mutex_);
  for (const ShownRange& one : shown) {
    if (one == volume->description().whole()) continue;
    for (const RangePart& part : parts_of(volume->description().format, one, distances)) {
      const auto known = find_entry(volume, part);
      const bool is_computed = known != entries_.end() && known->bytes != 0;
      if (is_computed) entries_.splice(entries_.begin(), entries_, known);
      request->parts_.push_back({part, is_computed ? known->relevant.get() : nullptr});
      request->is_soon_ = request->is_soon_ && (is_computed || distances != Distances::measured);
    }
  }
  if (Relevant whole = find_whole(volume, shown, distances)) {
    request->promise_.set_value(std::move(whole));
    return request;
  }
  if (request->first_lacking() == nullptr || (request->is_soon_ && volume->has_bounds())) {
    lock.unlock();
    find_now(*request);
    return request;
  }
  Queue& queue = request->is_soon_ ? soon_ : measuring_;
  std::erase_if(queue.requests, [](const auto& other) { return other.expired(); });
  queue.requests.push_back(request);
  queue.has_requests.notify_one();
  return request;
}

// Puts together the parts of a request, all of which are known.
void RangeCache::answer(Answer& request) {
  const auto part_of = [&](const RangePart& part) {
    return std::find_if(request.parts_.begin(), request.parts_.end(), [&](const auto& one) { return one.part == part; })->relevant;
  };
  try {
    Relevant relevant;
    {
      const std::lock_guard lock(mutex_);
      relevant = find_whole(request.volume_, request.shown_, request.distances_);
    }
    if (!relevant) {
      relevant = find_relevant_updates(request.volume_, request.shown_, request.distances_, part_of);
      const auto is_same = [&](const Answer::Part& one) { return one.relevant == relevant; };
      const bool is_known = std::any_of(request.parts_.begin(), request.parts_.end(), is_same) || relevant.get() == &request.volume_->relevant();
      if (!is_known && !relevant->has_parts()) {
        relevant = counted(std::move(relevant));
        const std::lock_guard lock(mutex_);
        std::erase_if(wholes_, [](const Whole& whole) { return whole.relevant.expired(); });
        wholes_.push_back({request.volume_, request.distances_, relevant});
      }
    }
    request.promise_.set_value(std::move(relevant));
  } catch (...) {
    request.promise_.set_exception(std::current_exception());
  }
}

// What takes microseconds.
void RangeCache::find_now(Answer& request) {
  try {
    PartFinder finder(*request.volume_);
    for (Answer::Part& one : request.parts_) {
      if (!one.relevant) one.relevant = get_part(finder, request.volume_, one.part);
    }
  } catch (...) {
    request.promise_.set_exception(std::current_exception());
    return;
  }
  answer(request);
}

void RangeCache::stop() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
}

// Of the account that spent least the newest. nullptr: there is none. With the lock held.
RangeCache::Request RangeCache::next_request(Queue& queue) const {
  Request next;
  FairScheduler::Time least{};
  for (const auto& waiting : queue.requests) {
    Request request = waiting.lock();
    if (!request || request->is_busy_) continue;
    const FairScheduler::Time spent = scheduler_.spent(*request->payer_);
    if (next && spent > least) continue;
    least = spent;
    next = std::move(request);
  }
  return next;
}

// Hands a part to all requests that have it; takes out those that are complete. With the lock held.
std::vector<RangeCache::Request> RangeCache::take_complete(const Volume& volume, const RangePart& part, const Relevant& relevant) {
  std::vector<Request> complete;
  for (Queue* const queue : {&soon_, &measuring_}) {
    std::erase_if(queue->requests, [&](const std::weak_ptr<Answer>& waiting) {
      Request request = waiting.lock();
      if (!request) return true;
      if (request->volume_ != volume) return false;
      for (auto& one : request->parts_) {
        if (relevant && one.part == part) one.relevant = relevant;
      }
      if (request->is_busy_ || request->first_lacking() != nullptr) return false;
      complete.push_back(std::move(request));
      return true;
    });
  }
  return complete;
}

// Finds the next part that a request lacks, or puts its parts together.
void RangeCache::work_for(Request request, PartFinder& finder, SpareCores& cores) {
  std::vector<Request> done;
  std::unique_lock lock(mutex_);
  const auto* const lacking = request->first_lacking();
  const std::optional<RangePart> part = lacking == nullptr ? std::nullopt : std::optional(lacking->part);
  try {
    lock.unlock();
    Relevant relevant;
    if (part) on_spare_cores([&] { relevant = get_part(finder, request->volume_, *part); });
    lock.lock();
    request->is_busy_ = false;
    done = take_complete(request->volume_, part.value_or(RangePart()), relevant);
    lock.unlock();
    for (const Request& one : done) answer(*one);
  } catch (...) {
    request->promise_.set_exception(std::current_exception());
    if (!lock.owns_lock()) lock.lock();
    for (Queue* const queue : {&soon_, &measuring_}) std::erase_if(queue->requests, [&](const auto& other) { return other.lock() == request; });
    lock.unlock();
    done.push_back(request);
  }
  scheduler_.charge(*request->payer_, cores.take_time());
  for (const Request& one : done) one->on_ready_();
}

void RangeCache::serve(Queue& queue, SpareCores::Rests rests, const std::stop_token& stop) {
  yield_to_other_threads();
  SpareCores cores(stop, scheduler_, rests, memory_.data_memory());
  Volume volume;
  std::optional<PartFinder> finder;  // of `volume`; both while there is something to find, and a little longer
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const auto has_request = [&] { return next_request(queue) != nullptr; };
    if (finder) queue.has_requests.wait_for(lock, stop, kFinderKept, has_request);
    Request request = next_request(queue);
    if (!request || request->volume_ != volume) {
      finder.reset();
      volume.reset();
    }
    if (!request) {
      queue.has_requests.wait(lock, stop, has_request);
      continue;
    }
    request->is_busy_ = true;
    lock.unlock();
    {
      const ScratchMemory::Scope scope(memory_.data_memory());  // measuring takes as much as the samples
      if (!volume) finder.emplace(*(volume = request->volume_), cores.all());
      work_for(std::move(request), *finder, cores);
    }
    lock.lock();
  }
}

}  // namespace intervale
