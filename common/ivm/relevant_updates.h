// Which updates of an interval volume are relevant to a range, and how far the surfaces of that range can move.
//
// Weiss and De Floriani 2008, section 6. A range needs the updates that count for it (front.h): of a data set of one
// range most of them, of one that was refined uniformly, or that has every range, a part. Their ancestors have to be
// split before them, but are not wanted for their own sake: where all that counts below an update is finer than what is
// wanted, it would change no mesh. Several ranges need what each of them needs. What a brick needs is known from the
// start, or found when it is first asked for; until then there are bounds. Shared by all sessions that look at those
// ranges.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/ivm/brick_needs.h"
#include "common/ivm/distance_codes.h"
#include "common/patch/description.h"
#include "common/util/lazy_array.h"
#include "common/util/parallel.h"

namespace intervale {

class IntervalVolume;

// What is known of how far surfaces move.
struct SurfaceErrors {
  std::vector<ErrorToDistance> to_distance;  // by supercube
  std::vector<std::uint8_t> slopes = {};     // by number of the update, at most kMaxSlope; empty: not known
  std::vector<std::uint8_t> distances = {};  // by number of the update; empty: not known, to_distance says what is
};

// The errors of an interval volume, by number of the update.
struct UpdateErrors {
  std::span<const std::uint8_t> steps;  // which of `values` its error is
  std::span<const float> values;        // ascending, at most 256
};

// Any thread. Copies share what is found.
class RelevantUpdates {
 public:
  // What is known of updates; and whether codes of an ErrorToDistance may be far ones.
  struct Known {
    bool slopes = false, distances = false, far = false;
  };
  // All of it is known. slots: by supercube; empty: all updates of the set. shown: what they are relevant to, one range
  // at least. The set must outlive the constructor only.
  RelevantUpdates(const Grid& grid, const SupercubeSet& set, const UpdateErrors& errors, ShownRanges shown, const std::vector<std::uint64_t>& slots,
                  const SurfaceErrors& surface, const ParallelFor& parallel = serial);
  // The same, found at once. nullopt: nothing of that brick is relevant.
  using FindAny = std::function<std::optional<BrickPart>(BrickIndex)>;
  RelevantUpdates(const Grid& grid, const SupercubeSet& set, const UpdateErrors& errors, ShownRanges shown, Known known, const FindAny& find,
                  const ParallelFor& parallel);

  // Upper bounds over the relevant updates of a brick; all 0 if it has none.
  struct Bound {
    std::uint16_t updates = 0;  // their number
    std::uint8_t error_step = 0, slope = 0;
    float object_error = 0;
  };
  // The same of a run, kRun bricks with consecutive numbers from kRun times its number on: the most of each, and how
  // many updates there are at most.
  static constexpr std::size_t kRun = 64;
  struct RunBound {
    std::uint32_t updates = 0;
    std::uint8_t error_step = 0, slope = 0;
    float object_error = 0;
    void add(const Bound& brick) { raise(brick.updates, brick.error_step, brick.slope, brick.object_error); }
    void add(const RunBound& part) { raise(part.updates, part.error_step, part.slope, part.object_error); }

   private:
    void raise(std::uint32_t more_updates, std::uint8_t step, std::uint8_t steepest, float farthest) {
      updates += more_updates;
      error_step = std::max(error_step, step);
      slope = std::max(slope, steepest);
      object_error = std::max(object_error, farthest);
    }
  };
  // Finds what a brick needs, on any thread; may be called twice for one brick, with the same result.
  using Find = std::function<BrickPart(BrickIndex)>;
  // Found by brick. bounds: of each brick. known: of all bricks.
  RelevantUpdates(const Grid& grid, const UpdateErrors& errors, ShownRanges shown, std::vector<Bound> bounds, Known known, Find find);

  [[nodiscard]] const ShownRanges& shown() const { return shown_; }
  // What is known without finding more: exact if all was known from the start.
  [[nodiscard]] Bound bound(BrickIndex brick) const { return parts_.empty() ? bounds_[brick] : bound(brick, kAllParts); }
  [[nodiscard]] RunBound run_bound(std::size_t run) const {
    if (parts_.empty()) return runs_[run];
    RunBound all;
    for (const auto& part : parts_) all.add(part->runs_[run]);
    return all;
  }
  // Found now if need be: some 50 microseconds for each part. Throws what prevents it, for example that memory is
  // exhausted. As long as this exists.
  [[nodiscard]] BrickNeeds brick(BrickIndex index) const { return parts_.empty() ? own_needs(index) : brick(index, kAllParts); }
  [[nodiscard]] bool is_found(BrickIndex brick) const;

  // How far the surfaces can still move, in world units, while an update's diamond is refined completely. An estimate:
  // 99 % of the surface should move no further, and nothing more than twice as far (FORMAT.md, "From errors to
  // distances"). Where distances are known, that is what they say, and it grows with the distance. Otherwise it depends
  // on the update's supercube and scale, and grows with the error step. Not saturated.
  [[nodiscard]] float object_error(ErrorToDistance to_distance, int scale, unsigned step, std::uint8_t distance) const {
    return has_distances() ? this->distance(distance) : object_error(to_distance, scale, step);
  }
  // From the error, whatever is known.
  [[nodiscard]] float object_error(ErrorToDistance to_distance, int scale, unsigned step) const {
    return std::min(codes_->error[step] * codes_->factor[to_distance.code()],
                    codes_->reach * (to_distance.is_far() ? kMaxFarDeviation : float(1 << scale)));
  }
  // The greatest distance that has a code and is no larger.
  [[nodiscard]] std::uint8_t code_below(float distance) const {
    const auto& all = codes_->distance;
    return std::uint8_t(std::upper_bound(all.begin() + 1, all.end(), distance) - all.begin() - 1);
  }
  [[nodiscard]] float distance(std::uint8_t code) const { return codes_->distance[code]; }
  [[nodiscard]] bool has_distances() const { return known_.distances; }  // of updates
  [[nodiscard]] bool has_slopes() const { return known_.slopes; }
  [[nodiscard]] bool may_be_far() const { return known_.far; }
  // It has parts, and keeps nothing itself. To make it takes next to no time.
  [[nodiscard]] bool has_parts() const { return !parts_.empty(); }
  // Some of at most BrickNeeds::kMostParts parts, a bit each.
  using PartMask = std::uint8_t;
  // Those of its parts that another one has, and where: for each of them its number there, or -1. nullopt: one has no
  // parts, or what is known of their updates is not alike. Both of one volume.
  using SharedParts = std::array<std::int8_t, BrickNeeds::kMostParts>;
  [[nodiscard]] std::optional<SharedParts> shared_with(const RelevantUpdates& other) const;
  // bound() and brick() of some parts.
  [[nodiscard]] Bound bound(BrickIndex brick, PartMask parts) const;
  [[nodiscard]] BrickNeeds brick(BrickIndex brick, PartMask parts) const;
  static constexpr PartMask kAllParts = 0xff;
  [[nodiscard]] std::size_t memory_bytes() const;  // by now, besides its parts
  // Called when memory_bytes() have grown, on the thread that found something. To be set before others have this, which
  // has no parts.
  void set_on_growth(std::function<void()> on_growth) const { found_->on_growth = std::move(on_growth); }

 private:
  struct Found {
    LazyArray<BrickPart> bricks;
    Find find;
    std::function<void()> on_growth = {};
    std::atomic<std::size_t> bytes = 0;
    Found(std::size_t count, Find how) : bricks(count), find(std::move(how)) {}
    const BrickPart& find_now(BrickIndex brick);
  };
  // What codes say, in world units. Of one volume all have the same.
  struct Codes {
    std::vector<float> error;         // by error step
    std::array<float, 256> factor;    // by code of an ErrorToDistance
    std::array<float, 256> distance;  // by distance of an update
    float reach = 0;                  // the largest object error for h = 1: half a diamond's width
    Codes(const Grid& grid, const UpdateErrors& errors);
  };
  void bound_runs();
  [[nodiscard]] Bound bound_of(const SupercubeSet& set, BrickIndex b, const BrickPart& brick) const;
  using Parts = std::vector<std::shared_ptr<const RelevantUpdates>>;
  RelevantUpdates(const SupercubeSet& set, Parts parts, ShownRanges shown);
  friend RelevantUpdates united(const IntervalVolume& volume, Parts each, ShownRanges shown);
  [[nodiscard]] const BrickPart& own_brick(BrickIndex brick) const {
    const BrickPart* const found = found_->bricks.find(brick);
    return found != nullptr ? *found : found_->find_now(brick);
  }
  // Nothing, too, where nothing was kept since nothing is relevant.
  [[nodiscard]] BrickNeeds own_needs(BrickIndex brick) const {
    const BrickPart* const found = found_->bricks.find(brick);
    if (found != nullptr) return BrickNeeds(*found);
    return bounds_[brick].updates == 0 ? BrickNeeds() : BrickNeeds(found_->find_now(brick));
  }

  ShownRanges shown_;
  Known known_;
  std::shared_ptr<const Codes> codes_;
  Parts parts_;                        // none of which has parts
  const SupercubeSet* set_ = nullptr;  // if there are parts
  std::vector<Bound> bounds_;          // by brick, unless there are parts
  std::vector<RunBound> runs_;         // likewise by run
  std::shared_ptr<Found> found_;       // likewise; otherwise null
};

// What several ranges, or the parts of one, need together: an update is relevant if it is to any of them, and the
// surfaces around it can move as far as those that can move farthest. Where some have distances, what is relevant to
// the others gets them from errors: also inside, where values may show. each: of this volume, one at least. shown: the
// ranges. If the same is known of each of them, it has them as parts; otherwise it is found by brick, O(bricks). The
// volume must outlive it.
[[nodiscard]] RelevantUpdates united(const IntervalVolume& volume, std::vector<std::shared_ptr<const RelevantUpdates>> each, ShownRanges shown);

}  // namespace intervale
