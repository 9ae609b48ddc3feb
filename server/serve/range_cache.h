// What ranges need of the data sets that are served (RelevantUpdates), shared by all sessions.
#pragma once

#include <cstddef>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>

#include "common/ivm/interval_volume.h"

namespace intervale {

// Any thread.
class RangeCache {
 public:
  using Volume = std::shared_ptr<const IntervalVolume>;
  using Relevant = std::shared_ptr<const RelevantUpdates>;
  // Computes it for one range. shown: as check_held() accepts it.
  using Find = std::function<Relevant(const Volume& volume, const ShownRange& shown)>;

  // most_bytes: of the results that are kept for later; those in use stay anyway.
  explicit RangeCache(Find find, std::size_t most_bytes = std::size_t(256) << 20) : find_(std::move(find)), most_bytes_(most_bytes) {}

  // Computes it if nobody has, or waits for whoever does; about a microsecond for each update of the volume and range
  // then. shown: as distinct() gives them, one at least. Several are united of what each needs.
  [[nodiscard]] Relevant get(const Volume& volume, const ShownRanges& shown);

 private:
  struct Entry {
    std::weak_ptr<const IntervalVolume> volume;
    ShownRanges shown;
    std::shared_future<Relevant> relevant;
    std::size_t bytes = 0;  // 0: not computed yet
  };
  [[nodiscard]] Relevant compute(const Volume& volume, const ShownRanges& shown);
  void drop_old();

  Find find_;
  std::size_t most_bytes_;
  std::mutex mutex_;
  std::list<Entry> entries_;  // the one used last is the first
};

}  // namespace intervale
