// Sigma: a compact multiresolution interval volume. Updates only, no field; immutable, shared by all that read it.
//
// Weiss and De Floriani 2008, section 6. For each relevant diamond it holds an update: the value at the centre, from
// which and from the values at the diamond's vertices the side of the centre and the cuts on the subdivision edges
// follow, and the saturated error, which tells whether a level of detail needs the update. The paper stores 12 bytes
// for each update and one for each cut; here supercubes (supercube.h) replace the coordinates and the pointer, and the
// value the cuts.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/ivm/field_statistics.h"
#include "common/ivm/relevant_updates.h"
#include "common/ivm/value_keys.h"
#include "common/patch/description.h"
#include "common/patch/range.h"
#include "common/util/parallel.h"
#include "common/util/result.h"
#include "common/view/screen_error.h"

namespace intervale {

inline constexpr int kMaxErrorSteps = 256;  // distinct errors at most; each update's is rounded up to one of them

class ValueBounds;

class IntervalVolume {
 public:
  // The arrays that an interval volume is made of.
  struct Parts {
    Description description;  // updates are computed
    SupercubeSet set;
    ValueKeys keys;                   // by number of the update: of the value at the diamond's centre
    std::vector<std::uint8_t> steps;  // by number of the update: which of error_steps its error is
    std::vector<float> error_steps;   // ascending, at most kMaxErrorSteps
    SurfaceErrors surface;            // by supercube, and by number of the update
    std::shared_ptr<const FieldStatistics> statistics = {};
    std::vector<std::uint64_t> left = {};  // by supercube: the slots whose values are known, closed under parents; empty: all
    std::size_t finer = 0;                 // updates of finer scales that are still to come
  };
  // Fails where sizes or ranges of the parts do not match; validate() checks the meaning.
  static Result<IntervalVolume> assemble(Parts parts, const ParallelFor& parallel = serial);

  [[nodiscard]] const Description& description() const { return description_; }
  [[nodiscard]] const Domain& domain() const { return domain_; }
  [[nodiscard]] const SupercubeSet& set() const { return set_; }
  [[nodiscard]] std::size_t size() const { return set_.size(); }
  // Whether it has all updates of the data set. Otherwise finer scales are still to come (coarse_scales.h): the whole data
  // set gives its updates the same numbers, and has the same description.
  [[nodiscard]] bool is_whole() const { return description_.updates == set_.size(); }
  // No update of those that are still to come has a greater error; 0 if it is whole.
  [[nodiscard]] float error_of_finer() const { return error_of_finer_; }

  // Saturated error in the field's units, rounded up: no smaller than that of any child. Monotone in error_step.
  [[nodiscard]] float error(UpdateIndex i) const { return error_steps_[steps_[i]]; }
  [[nodiscard]] unsigned error_step(UpdateIndex i) const { return steps_[i]; }
  [[nodiscard]] std::span<const float> error_steps() const { return error_steps_; }
  [[nodiscard]] std::span<const std::uint8_t> steps() const { return steps_; }
  [[nodiscard]] ValueKey key(UpdateIndex i) const { return keys_[i]; }  // of the value at the diamond's centre
  [[nodiscard]] const ValueKeys& keys() const { return keys_; }
  // What counts for the range of the description (front.h), but for lost updates.
  [[nodiscard]] const RelevantUpdates& relevant() const { return relevant_; }
  // By brick: where its diamonds are.
  [[nodiscard]] const ScreenError::Regions& brick_regions() const { return brick_regions_; }
  // The same by run of them (RelevantUpdates::kRun).
  [[nodiscard]] const ScreenError::Regions& run_regions() const { return run_regions_; }
  // Of a supercube: the slots whose values a damaged file has not lost (page_faults.h). Closed under parents.
  [[nodiscard]] std::uint64_t left(SupercubeIndex s) const { return left_.empty() ? set_.occupancy()[s] : left_[s]; }
  // How many updates a damaged file has lost. O(supercubes) if there are any.
  [[nodiscard]] std::uint64_t lost_updates() const;
  // For other ranges than its own; it must have been refined uniformly. The first call finds them, in O(updates);
  // calls meanwhile wait for it. Any thread.
  [[nodiscard]] const ValueBounds& bounds(const ParallelFor& parallel = serial) const;
  [[nodiscard]] bool has_bounds() const;  // they are found
  // Null: a data set of one range has none.
  [[nodiscard]] const FieldStatistics* statistics() const { return statistics_.get(); }
  [[nodiscard]] std::size_t memory_bytes() const;

  // Channels, which it has none of at first: those of the description, and their keys by component and number.
  [[nodiscard]] const std::vector<ChannelKeys>& channel_keys() const { return channel_keys_; }
  // Fails as check_channels() does, and where sizes or ranges do not match.
  [[nodiscard]] Result<void> set_channels(std::vector<Channel> channels, std::vector<ChannelKeys> keys);

 private:
  struct LazyBounds;
  using BrickRegions = std::vector<ScreenError::Region>;
  IntervalVolume(Parts parts, const BrickRegions& regions, const ParallelFor& parallel);
  Description description_;
  Domain domain_;
  SupercubeSet set_;
  ValueKeys keys_;
  std::vector<std::uint8_t> steps_;
  std::vector<float> error_steps_;
  std::vector<std::uint64_t> left_;  // by supercube; empty: all
  RelevantUpdates relevant_;
  ScreenError::Regions brick_regions_, run_regions_;
  std::shared_ptr<LazyBounds> bounds_;  // not null; of all copies
  std::shared_ptr<const FieldStatistics> statistics_;
  std::vector<ChannelKeys> channel_keys_;
  float error_of_finer_ = 0;
};

}  // namespace intervale
