// Range coding of the error steps and the slopes of a data set of one range. FORMAT.md is the specification.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/codec/range_coder.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/interval_volume.h"
#include "common/util/parallel.h"

namespace intervale {

inline bool is_overdrawn(const RangeDecoder& coder) { return coder.is_overdrawn(); }
inline bool is_overdrawn(const RangeEncoder&) { return false; }

// Error steps, by update, from fine to coarse: an error is no smaller than its children's, and often equal to the
// largest of them. Coder is a RangeEncoder, which writes `steps`, each below kMaxErrorSteps; or a RangeDecoder, which
// fills it. `parallel` may stop it. False if what was decoded is more than the bytes hold.
template <class Coder>
bool code_error_steps(Coder& coder, const SupercubeSet& set, std::span<std::uint8_t> steps, const ParallelFor& parallel) {
  std::array<std::array<NumberModel<8>, 2>, 3> without_children;
  std::array<std::array<SmallNumberModel, 2>, 3> above_children;
  std::vector<std::uint16_t> least(set.size());  // the largest step of a child plus 1; 0 without children
  static_assert(kMaxErrorSteps == 256);
  SetNeighbours around(set);
  const auto visit = [&](const Place& p) {
    const int cls = class_of_slot(p.slot), finest = scale_of_key(p.key) == 0;
    std::uint8_t& step = steps[p.index];
    const unsigned from = least[p.index];
    if (from == 0) {
      step = std::uint8_t(without_children[cls][finest].code(coder, step));
    } else {
      step = std::uint8_t(from - 1 + above_children[cls][finest].code(coder, (step - from + 1) & 255u));
    }
    for_each_parent(around, p.key, p.slot,
                    [&](const SetNeighbours::Diamond& parent) { least[parent.index()] = std::max(least[parent.index()], std::uint16_t(step + 1)); });
  };
  for (int scale = 0; scale < kMaxLevels; ++scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (int cls = 2; cls >= 0; --cls) {
      for (BrickIndex brick = begin; brick < end; ++brick) {
        may_stop(parallel);
        set.for_each_in_brick(brick, kSlotsOfClass[std::size_t(cls)], visit);
        if (is_overdrawn(coder)) return false;
      }
    }
  }
  return true;
}

// Slopes, by update, from coarse to fine: each is mostly near its parents' and the one before. As code_error_steps(), of
// slopes that are at most kMaxSlope.
template <class Coder>
bool code_update_slopes(Coder& coder, const SupercubeSet& set, std::span<std::uint8_t> slopes, const ParallelFor& parallel) {
  static_assert(kMaxSlope == 15);
  struct OfClass {
    std::array<std::array<NumberModel<4>, 4>, 16> model;  // by the mean of the parents, and a quarter of the one before
  };
  const auto models = std::make_unique<std::array<std::array<OfClass, 2>, 3>>();  // by class, and whether it is the finest
  SetNeighbours around(set);
  for (int scale = kMaxLevels - 1; scale >= 0; --scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (int cls = 0; cls <= 2; ++cls) {
      OfClass& here = (*models)[std::size_t(cls)][scale == 0];
      for (BrickIndex brick = begin; brick < end; ++brick) {
        may_stop(parallel);
        unsigned before = 0;
        set.for_each_in_brick(brick, kSlotsOfClass[std::size_t(cls)], [&](const Place& p) {
          unsigned sum = 0, parents = 0;
          for_each_parent(around, p.key, p.slot, [&](const SetNeighbours::Diamond& parent) {
            sum += slopes[parent.index()];
            ++parents;
          });
          const unsigned mean = parents == 0 ? kMaxSlope : sum / parents;
          before = here.model[mean][before / 4].code(coder, slopes[p.index]);
          slopes[p.index] = std::uint8_t(before);
        });
        if (is_overdrawn(coder)) return false;
      }
    }
  }
  return true;
}

}  // namespace intervale
