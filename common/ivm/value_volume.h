// The values of a field at the centres of all diamonds, with their errors: an interval volume of every range.
//
// Where interval_volume.h keeps what one range needs, this keeps the field itself, in the order of the hierarchy: a key
// (value_format.h) for each diamond. Sides and cuts of any range follow from the values of a diamond's vertices. Every
// sample is the value of a diamond's centre or of a corner of the virtual grid, clamped to the box (domain.h), so nothing
// is lost. Immutable, shared by all that read it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/codec/value_prediction.h"
#include "common/diamond/domain.h"
#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/ivm/field_statistics.h"
#include "common/ivm/value_keys.h"
#include "common/patch/channel.h"
#include "common/patch/labels.h"
#include "common/patch/value_format.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// Errors of diamonds of scale 1 and coarser, saturated over all children, are rounded up to one of 32 levels: 0, and the
// largest error over powers of two. Those of scale 0 follow from the values.
using ErrorLevel = std::uint8_t;
inline constexpr int kErrorLevels = 32;

// Of a field, 4096 x 4096 x 4096: so that there are no more than kMostSupercubes, whatever the sides. In a browser numbers of
// diamonds have 32 bits.
inline constexpr std::uint64_t kMostSamples = sizeof(UpdateIndex) > 4 ? std::uint64_t(1) << 36 : 0x7fffffff;

// What is known of a field besides its values.
struct FieldDescription {
  std::string name;
  Grid grid;
  Labels labels;
  ValueFormat format;
  std::array<ValueKey, kRootVertices> corners{};  // at the root's vertices, in local order
  bool is_exact = true;                           // whether every sample is the value of its key
  double max_error = 0;                           // the largest error, in the field's units
  FieldStatistics statistics;
  // Of the file that it was read from: of its contents, where the name and the labels do not count. 0: it was not read.
  std::uint64_t content_hash = 0;
  std::vector<Channel> channels;
  friend bool operator==(const FieldDescription&, const FieldDescription&) = default;
};

// The error of linear interpolation between the ends of a spine, at its middle: no larger than the diamond's.
[[nodiscard]] inline double spine_error(const ValueFormat& format, ValueKey end_0, ValueKey end_1, ValueKey centre) {
  return std::abs(format.value(centre) - (format.value(end_0) / 2 + format.value(end_1) / 2));
}

// Of a page (value_page.h): no key around its diamonds, their parents of the same scale, and all descendants of both is
// less than the least, or greater than the greatest.
struct PageBounds {
  ValueKey least = 0, greatest = 0;
  friend bool operator==(const PageBounds&, const PageBounds&) = default;
};

class ValueVolume {
 public:
  struct Parts {
    FieldDescription description;
    ValueWeights weights;
    SupercubeSet set;                            // all_diamonds()
    ValueKeys keys;                              // by number
    std::vector<ErrorLevel> error_levels;        // by number; of all diamonds of scale 1 and coarser, which come first
    std::vector<ChannelKeys> channel_keys = {};  // by channel of the description, and component
    std::vector<std::uint64_t> left = {};        // as in IntervalVolume::Parts
    std::vector<PageBounds> page_bounds = {};    // as the file has them that it was read from; empty: it has none
    std::size_t finer = 0;                       // diamonds of finer scales than the set has: it has those of all others
  };
  explicit ValueVolume(Parts parts);

  [[nodiscard]] const Parts& parts() const { return parts_; }
  [[nodiscard]] Parts take() && { return std::move(parts_); }
  [[nodiscard]] const FieldDescription& description() const { return parts_.description; }
  [[nodiscard]] const Domain& domain() const { return domain_; }
  [[nodiscard]] const ValueWeights& weights() const { return parts_.weights; }
  [[nodiscard]] const SupercubeSet& set() const { return parts_.set; }
  [[nodiscard]] ValueKey key(UpdateIndex i) const { return parts_.keys[i]; }
  // The error of a level, in the field's units: 0 for level 0.
  [[nodiscard]] double error(ErrorLevel level) const { return error_of_level(description().max_error, level); }
  [[nodiscard]] std::size_t memory_bytes() const;

  // Levels and errors: error_of_level(e, kErrorLevels - 1) = e. The level of an error is the least whose error is no
  // smaller; error at most `max_error`.
  [[nodiscard]] static double error_of_level(double max_error, ErrorLevel level);
  [[nodiscard]] static ErrorLevel level_of_error(double max_error, double error);

 private:
  Parts parts_;
  Domain domain_;
};

// All diamonds of a domain that have an update, of the scale `finest` and coarser: those that exist, and whose split is
// not a no-op. `parallel` may stop it.
[[nodiscard]] SupercubeSet all_diamonds(const Domain& domain, const ParallelFor& parallel = serial, int finest = 0);
// How many there are in the supercubes of a scale whose positions are `first` to `last` on each axis, both included; and of
// all scales. By coordinates, not by diamond: O(last - first).
[[nodiscard]] std::uint64_t count_diamonds(const Domain& domain, int scale, Vertex first, Vertex last);
[[nodiscard]] std::uint64_t count_diamonds(const Domain& domain);
// How many supercubes all_diamonds() has, and bricks. By coordinates, too: O(samples of an axis).
struct SetCounts {
  std::uint64_t bricks = 0, supercubes = 0;
  friend bool operator==(const SetCounts&, const SetCounts&) = default;
};
[[nodiscard]] SetCounts count_supercubes(const Domain& domain);

// All diamonds as of all_diamonds(), of those supercubes that are wanted.
[[nodiscard]] SupercubeSet some_diamonds(const Domain& domain, const std::function<bool(int scale, Vertex position)>& wanted,
                                         const ParallelFor& parallel = serial);

// The slots of one supercube that all_diamonds() has, a bit each. position: from 0 to last_supercube(); others have none.
[[nodiscard]] std::uint64_t updated_slots(const Domain& domain, int scale, Vertex position);
[[nodiscard]] Vertex last_supercube(const Domain& domain, int scale);

// How many diamonds of a set are of scale 1 or coarser; they have the first numbers.
[[nodiscard]] std::size_t coarse_diamonds(const SupercubeSet& set);

}  // namespace intervale
