// What ranges need of the data sets that are served (RelevantUpdates), shared by all sessions.
//
// A range consists of parts, one for each of its surfaces (find_relevant_updates.h). Each part is found once, for all
// ranges that have it, and kept. Distances are estimated at once; a thread of its own measures them, for the newest
// request first. Ranges of several parts are put together for each session, and shared while one has them.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
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
  using Find = std::function<Relevant(PartFinder& finder, const RangePart& part)>;

  // most_bytes: of the parts that are kept for later; those in use stay anyway.
  explicit RangeCache(Find find = &PartFinder::find, std::size_t most_bytes = std::size_t(256) << 20);

  // Computes what nobody has, or waits for whoever does; find_relevant_updates.h says how long that takes. shown: as
  // distinct() gives them, one at least. Some distances may be better known than asked for.
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
    struct Part {
      RangePart part;
      Relevant relevant;  // nullptr: not measured yet
    };
    std::vector<Part> parts_;
    std::promise<Relevant> promise_;
    std::shared_future<Relevant> result_ = promise_.get_future().share();
    std::function<void()> on_ready_;
  };
  // get() with measured distances, on another thread unless they are known: ready then. Nothing is measured for
  // requests that are released before their turn. on_ready: called once a request that was not ready is, on that
  // thread, without any lock held.
  [[nodiscard]] std::shared_ptr<const Measurement> measure(const Volume& volume, const ShownRanges& shown, std::function<void()> on_ready);

  // Measures nothing more; what is being measured is given up within milliseconds. Also done on destruction.
  void stop();

 private:
  struct Entry {
    std::weak_ptr<const IntervalVolume> volume;
    RangePart part;
    std::shared_future<Relevant> relevant;
    std::size_t bytes = 0;  // 0: not computed yet
  };
  // A range of several parts.
  struct Whole {
    std::weak_ptr<const IntervalVolume> volume;
    Distances distances = Distances::none;
    std::weak_ptr<const RelevantUpdates> relevant;
  };
  using Request = std::shared_ptr<Measurement>;

  [[nodiscard]] std::list<Entry>::iterator find_entry(const Volume& volume, const RangePart& part);
  [[nodiscard]] Relevant get_part(PartFinder& finder, const Volume& volume, const RangePart& part);
  [[nodiscard]] Relevant put_together(const Volume& volume, const ShownRanges& shown, Distances distances, const FindPart& find);
  void drop_old(const Volume& volume, const RangePart& found);
  void measure_all(const std::stop_token& stop);
  [[nodiscard]] Request newest_request();
  [[nodiscard]] std::vector<Request> requests_with(const Volume& volume, const RangePart& part, const Relevant& relevant);
  void measure_next(PartFinder& finder, const Request& request);
  void answer(Measurement& request);

  Find find_;
  std::size_t most_bytes_;
  std::mutex mutex_;
  std::list<Entry> entries_;  // the one used last is the first
  std::vector<Whole> wholes_;
  std::condition_variable_any has_requests_;
  std::vector<std::weak_ptr<Measurement>> requests_;  // the newest is the last
  std::jthread measuring_;                            // the last member: it uses the others
};

}  // namespace intervale
