// What ranges need of the data sets that are served (RelevantUpdates), shared by all sessions.
//
// A range consists of parts, one for each of its surfaces (find_relevant_updates.h). Each part is found once, for all
// ranges that have it, and kept. Ranges of several parts are put together for each session; those that find something
// themselves are shared while one has them. Where distances need not be measured, that takes microseconds: whoever asks
// does it, and what a brick needs is found when a session comes to it (relevant_updates.h). To measure distances takes
// up to a second and cannot be cut into slices, so a thread of its own does it, behind the sessions' work; another
// finds the bounds of a data set's values, which the first range of it needs. Each serves the account that spent least,
// and the newest request of that account, first.
#pragma once

#include <boost/functional/hash.hpp>
#include <boost/unordered/unordered_flat_map.hpp>
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
#include "protocol/session/session_worker.h"
#include "server/serve/fair_scheduler.h"
#include "server/serve/memory.h"
#include "server/serve/spare_cores.h"

namespace intervale {

// Any thread.
class RangeCache {
 public:
  using Volume = std::shared_ptr<const IntervalVolume>;
  using Relevant = RangeAnswer::Relevant;
  using Find = std::function<Relevant(PartFinder& finder, const RangePart& part)>;

  using Payer = std::shared_ptr<FairScheduler::Account>;

  // memory: counts what is kept or in use, and must outlive that. scheduler: of the accounts that pay; it must outlive
  // this. most_bytes: of the parts that are kept for later; those in use, and the two that were used last, stay
  // anyway.
  RangeCache(Memory& memory, FairScheduler& scheduler, Find find = &PartFinder::find, std::size_t most_bytes = std::size_t(256) << 20);
  RangeCache(const RangeCache&) = delete;
  RangeCache& operator=(const RangeCache&) = delete;
  ~RangeCache() { stop(); }

  class Answer : public RangeAnswer {
   public:
    [[nodiscard]] bool is_ready() const override { return result_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }
    [[nodiscard]] bool is_soon() const override { return is_soon_; }
    [[nodiscard]] Relevant result() const override { return result_.get(); }

   private:
    friend class RangeCache;
    struct Part {
      RangePart part;
      Relevant relevant;  // nullptr: not found yet
    };
    [[nodiscard]] Part* first_lacking();
    Volume volume_;
    ShownRanges shown_;
    Distances distances_ = Distances::none;
    Payer payer_;
    std::vector<Part> parts_;
    bool is_soon_ = true;
    bool is_busy_ = false;  // a thread works for it
    std::promise<Relevant> promise_;
    std::shared_future<Relevant> result_ = promise_.get_future().share();
    std::function<void()> on_ready_;
  };
  // As SessionWorker::ask(). on_ready: called once an answer that was not ready is, on another thread, without any lock
  // held.
  [[nodiscard]] std::shared_ptr<const Answer> ask(const Volume& volume, const ShownRanges& shown, Distances distances, Payer payer,
                                                  std::function<void()> on_ready);

  // Finds nothing more; what is being found is given up within milliseconds. Also done on destruction.
  void stop();

 private:
  // What an entry is found by. A volume that was at the same address before has another owner.
  struct Key {
    const IntervalVolume* volume = nullptr;
    RangePart part;
    friend bool operator==(const Key&, const Key&) = default;
    friend std::size_t hash_value(const Key& key) {
      std::size_t hash = 0;
      boost::hash_combine(hash, key.volume);
      boost::hash_combine(hash, key.part.shown.range.alpha);
      boost::hash_combine(hash, key.part.shown.range.beta);
      boost::hash_combine(hash, int(key.part.shown.refine));
      boost::hash_combine(hash, int(key.part.distances));
      return hash;
    }
  };
  struct Entry {
    Key key;
    std::weak_ptr<const IntervalVolume> volume;
    std::shared_future<Relevant> relevant;
    std::size_t bytes = 0;  // 0: not computed yet
    [[nodiscard]] bool is_of(const Volume& other) const { return !volume.owner_before(other) && !other.owner_before(volume); }
  };
  // A range of several parts that has not the same of each of them, and so finds something itself.
  struct Whole {
    std::weak_ptr<const IntervalVolume> volume;
    Distances distances = Distances::none;
    std::weak_ptr<const RelevantUpdates> relevant;
  };
  using Request = std::shared_ptr<Answer>;
  struct Queue {
    std::vector<std::weak_ptr<Answer>> requests;  // the newest is the last
    std::condition_variable_any has_requests;
  };

  using Entries = std::list<Entry>;
  [[nodiscard]] Entries::iterator find_entry(const Volume& volume, const RangePart& part);
  void hide(Entries::iterator entry);
  [[nodiscard]] Relevant find_whole(const Volume& volume, const ShownRanges& shown, Distances distances) const;
  [[nodiscard]] Relevant counted(Relevant relevant) const;
  [[nodiscard]] Relevant get_part(PartFinder& finder, const Volume& volume, const RangePart& part);
  [[nodiscard]] Entries take_old(const Volume& volume, const RangePart& found);
  void serve(Queue& queue, SpareCores::Rests rests, const std::stop_token& stop);
  [[nodiscard]] Request next_request(Queue& queue) const;
  [[nodiscard]] std::vector<Request> take_complete(const Volume& volume, const RangePart& part, const Relevant& relevant);
  void work_for(Request request, PartFinder& finder, SpareCores& cores);
  void answer(Answer& request);
  void find_now(Answer& request);

  Memory& memory_;
  FairScheduler& scheduler_;
  Find find_;
  std::size_t most_bytes_;
  mutable std::mutex mutex_;
  Entries entries_;  // the one used last is the first
  boost::unordered_flat_map<Key, Entries::iterator> entry_of_;
  std::vector<Whole> wholes_;
  Queue soon_, measuring_;
  std::vector<std::jthread> threads_;
};

}  // namespace intervale
