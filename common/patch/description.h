// Everything about an interval volume except its updates.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/diamond/diamond.h"
#include "common/diamond/grid.h"
#include "common/patch/value_format.h"
#include "common/patch/value_weights.h"
#include "common/util/result.h"

namespace intervale {

enum class Refine : std::uint8_t { boundary = 0, uniform = 1 };  // which diamonds are relevant; see relevance.h

// The closed range of values kept, alpha <= beta; either may be infinite.
struct Range {
  double alpha = 0;
  double beta = 0;
  friend bool operator==(const Range&, const Range&) = default;
};

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
  Range range;
  Refine refine = Refine::boundary;
  ValueFormat format;                             // of the values
  bool is_exact = true;                           // whether every sample is the value of its key
  std::array<ValueKey, kRootVertices> corners{};  // at the root's vertices, in local order
  ValueWeights weights;                           // of the prediction of values
  double max_error = 0;                           // the largest error of a relevant diamond, in the field's units; 0 if there is none
  std::uint64_t updates = 0;                      // relevant diamonds
  std::uint64_t coefficients = 0;                 // cuts on their subdivision edges, at full detail
  FullMesh full;
  std::uint64_t content_hash = 0;  // of the contents; the name does not count
  friend bool operator==(const Description&, const Description&) = default;
};

// Checks a grid from outside: sides within bounds, a box that is finite and not flat.
[[nodiscard]] Result<void> check_grid(const Grid& grid);

// Checks a description from outside: sides within bounds, a box that is finite and not flat, a valid range, a format
// as check_value_format accepts it with the corners' keys in it, a finite error.
[[nodiscard]] Result<void> check_description(const Description& description);

}  // namespace intervale
