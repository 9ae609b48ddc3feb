// Everything about an interval volume except its updates.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/diamond/grid.h"
#include "common/patch/channel.h"
#include "common/patch/labels.h"
#include "common/patch/shown_range.h"
#include "common/patch/value_format.h"
#include "common/patch/value_weights.h"
#include "common/util/result.h"

namespace intervale {

// Size of the mesh at error 0.
struct FullMesh {
  std::uint64_t vertices = 0;
  std::uint64_t tets = 0;
  [[nodiscard]] std::uint64_t indexed_bytes() const { return 12 * vertices + 16 * tets; }  // three floats a vertex, four indices a tetrahedron
  friend bool operator==(const FullMesh&, const FullMesh&) = default;
};

// A client starts from this.
struct Description {
  std::string name;
  Grid grid;
  Labels labels;
  // What the data set has the updates for. Of every range: from -inf to inf, refined uniformly.
  Range range;
  Refine refine = Refine::boundary;
  bool has_every_range = false;                   // built for every range, and not for this one
  ValueFormat format;                             // of the values
  bool is_exact = true;                           // whether every sample is the value of its key
  std::array<ValueKey, kRootVertices> corners{};  // at the root's vertices, in local order
  ValueWeights weights;                           // of the prediction of values
  double max_error = 0;                           // the largest error of a relevant diamond, in the field's units; 0 if there is none
  std::uint64_t updates = 0;                      // relevant diamonds
  std::uint64_t coefficients = 0;                 // cuts on their subdivision edges, at full detail
  FullMesh full;
  // Of the file that it was read from: of its contents, where the name and the labels do not count. 0: it was not read.
  std::uint64_t content_hash = 0;
  std::vector<Channel> channels;
  // What is shown if nothing else is asked for.
  [[nodiscard]] ShownRange whole() const { return {range, refine}; }
  friend bool operator==(const Description&, const Description&) = default;
};

// What a request means: without a range, that of the data set. Another range than that, or one of every range, is refined
// at its surfaces if the request does not say how.
[[nodiscard]] ShownRange resolve(const Description& description, const std::optional<Range>& range, const std::optional<Refine>& refine);
// The same for each range of a request, in its order; at least one.
[[nodiscard]] ShownRanges resolve(const Description& description, const RangeRequest& request);

// Whether a data set has all that a range needs: its own range, or if it was refined uniformly any range within it.
// Otherwise misuse, with what the data set has.
[[nodiscard]] Result<void> check_held(const Description& description, const ShownRange& shown);
// The same for each of them; more than kMaxRanges are misuse, too.
[[nodiscard]] Result<void> check_held(const Description& description, const ShownRanges& shown);

// The least range that has all of them in it; one at least.
[[nodiscard]] Range range_around(const ShownRanges& shown);

// In an order that does not depend on theirs, and each once.
[[nodiscard]] ShownRanges distinct(ShownRanges shown);

// Checks a grid from outside: sides within bounds; an affine of finite numbers that is not singular, which is one whose
// determinant is above 1e-12 of the product of its columns' lengths; corners that a double holds.
[[nodiscard]] Result<void> check_grid(const Grid& grid);

// Checks a description from outside: sides within bounds, a box that is finite and not flat, a valid range, a format
// as check_value_format accepts it with the corners' keys in it, a finite error, labels as check_labels and channels as
// check_channels accept them.
[[nodiscard]] Result<void> check_description(const Description& description);

}  // namespace intervale
