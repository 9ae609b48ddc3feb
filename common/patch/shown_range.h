// Which ranges of values a mesh is made for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace intervale {

enum class Refine : std::uint8_t { boundary = 0, uniform = 1 };  // which diamonds are relevant; see relevance.h

// The closed range of values kept, alpha <= beta; either may be infinite.
struct Range {
  double alpha = 0;
  double beta = 0;
  friend bool operator==(const Range&, const Range&) = default;
};

// What a mesh is made for: a range, and which diamonds are relevant to it.
struct ShownRange {
  Range range;
  Refine refine = Refine::boundary;
  friend bool operator==(const ShownRange&, const ShownRange&) = default;
};

// Several ranges may be shown at once, a mesh for each: no more than this.
inline constexpr std::size_t kMaxRanges = 4;
using ShownRanges = std::vector<ShownRange>;

// What somebody asks to be shown of a data set; what is not said follows from the data set (resolve()).
struct RangeRequest {
  std::vector<Range> ranges;  // none: that of the data set
  std::optional<Refine> refine;
  friend bool operator==(const RangeRequest&, const RangeRequest&) = default;
};

// The ranges that are asked for, of a data set of every range. refine: where that is not said.
[[nodiscard]] inline ShownRanges asked_for(const RangeRequest& request, Refine refine) {
  ShownRanges shown;
  for (const Range& range : request.ranges) shown.push_back({range, request.refine.value_or(refine)});
  return shown;
}

}  // namespace intervale
