// What ranges need of the data sets that are served (RelevantUpdates), shared by all sessions.
//
// A range consists of parts, one for each of its surfaces (find_relevant_updates.h). Each part is found once, for all
// ranges that share it; estimates do for all ranges with the same values of keys inside. Distances are estimated at
// once; a thread of its own measures them, the newest request first.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "server/builder/find_relevant_updates.h"

namespace intervale {

// Any thread.
class RangeCache {
 public:
  using Volume = std::shared_ptr<const IntervalVolume>;
  using Relevant = std::shared_ptr<const RelevantUpdates>;
  using Find = std::function<Relevant(const IntervalVolume& volume, const ShownRange& part, Distances distances)>;

  // most_bytes: of the results that are kept for later; those in use stay anyway.
  explicit RangeCache(Find find = find_relevant_part, std::size_t most_bytes = std::size_t(256) << 20);

  // Computes what nobody has, or waits for whoever does; find_relevant_updates.h says how long that takes. shown: as
  // distinct() gives them, one at least. A data set's own range has measured distances in any case.
  [[nodiscard]] Relevant get(const Volume& volume, const ShownRanges& shown, Distances distances);

  // Distances that are being measured.
  class Measurement {
   public:
    [[nodiscard]] bool is_ready() const { return result_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }
    // If ready. Throws what prevented it, for example that memory is exhausted.
    [[nodiscard]] Relevant result() const { return result_.get(); }

   private:
    friend class RangeCache;
    Volume volume_;
    ShownRanges shown_;
    std::promise<Relevant> promise_;
    std::shared_future<Relevant> result_ = promise_.get_future().share();
    std::function<void()> on_ready_;
  };
  // get() with measured distances, on another thread unless they are known: ready then. Nothing is measured for
  // requests that are released before their turn. on_ready: called once a request that was not ready is, on that
  // thread, without any lock held.
  [[nodiscard]] std::shared_ptr<const Measurement> measure(const Volume& volume, const ShownRanges& shown, std::function<void()> on_ready);

  // Measures nothing more, and waits for what is being measured. Also done on destruction.
  void stop();

 private:
  struct Entry {
    std::weak_ptr<const IntervalVolume> volume;
    ShownRanges shown;
    Distances distances = Distances::none;
    std::shared_future<Relevant> relevant;
    std::size_t bytes = 0;  // 0: not computed yet
  };
  [[nodiscard]] std::list<Entry>::iterator find_entry(const Volume& volume, const ShownRanges& shown, Distances distances);
  [[nodiscard]] Relevant compute(const Volume& volume, const ShownRanges& shown, Distances distances);
  void drop_old();
  void measure_all(const std::stop_token& stop);

  Find find_;
  std::size_t most_bytes_;
  std::mutex mutex_;
  std::list<Entry> entries_;  // the one used last is the first
  std::condition_variable_any has_requests_;
  std::vector<std::weak_ptr<Measurement>> requests_;  // the newest is the last
  std::jthread measuring_;                            // the last member: it uses the others
};

}  // namespace intervale
