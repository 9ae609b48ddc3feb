// Range coding of the arrays that an .ivm file holds for all updates. Coder is a RangeEncoder, which writes the last
// argument, or a RangeDecoder, which fills it. FORMAT.md is the specification.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/residual_coder.h"
#include "common/ivm/interval_volume.h"

namespace intervale {

// Error steps, by update, from fine to coarse: an error is no smaller than its children's, and often equal to the
// largest of them.
template <class Coder>
void code_error_steps(Coder& coder, const SupercubeSet& set, std::span<std::uint16_t> steps) {
  std::array<std::array<NumberModel<9>, 2>, 3> without_children;
  std::array<std::array<SmallNumberModel, 2>, 3> above_children;
  std::vector<std::uint16_t> least(set.size());  // the largest step of a child plus 1; 0 without children
  static_assert(kMaxErrorSteps == 512);
  set.for_each_up([&](const Place& p) {
    const int cls = class_of_slot(p.slot), finest = scale_of_key(p.key) == 0;
    std::uint16_t& step = steps[p.index];
    const unsigned from = least[p.index];
    if (from == 0) {
      step = std::uint16_t(without_children[cls][finest].code(coder, step));
    } else {
      step = std::uint16_t((from - 1 + above_children[cls][finest].code(coder, (step - from + 1) & 511u)) & 511u);
    }
    for_each_parent(set, p, [&](UpdateIndex parent) { least[parent] = std::max(least[parent], std::uint16_t(step + 1)); });
  });
}

// Shapes (UpdateCode), by update, from coarse to fine: where the parents have many cuts, an update has many too.
template <class Coder>
void code_shapes(Coder& coder, const SupercubeSet& set, std::span<std::uint8_t> shapes) {
  std::array<std::array<std::array<NumberModel<7>, 16>, 2>, 3> model;
  set.for_each_down([&](const Place& p) {
    unsigned cuts = 0;
    for_each_parent(set, p, [&](UpdateIndex parent) { cuts += UpdateCode(shapes[parent]).coefficients(); });
    std::uint8_t& shape = shapes[p.index];
    shape = std::uint8_t(model[class_of_slot(p.slot)][scale_of_key(p.key) == 0][std::min(cuts, 15u)].code(coder, shape));
  });
}

// Residuals, of all updates, concatenated.
template <class Coder>
void code_residuals(Coder& coder, const SupercubeSet& set, std::span<const std::uint8_t> shapes, std::span<std::uint8_t> residuals) {
  ResidualCoder model;
  std::uint8_t* next = residuals.data();
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) {
      const UpdateCode code(shapes[p.index]);
      model.code_cuts(coder, class_of_slot(p.slot), code.side_residual(), code.coefficients(), code.first_cuts(), next);
      next += code.coefficients();
    });
  }
}

}  // namespace intervale
