#include "common/refinement.h"

#include <bit>
#include <cmath>
#include <limits>

#include "common/domain.h"

namespace intervale {
namespace {

// The domain of a diamond in samples, closed.
struct SampleBox {
  std::array<double, 3> min, max;
};

bool meets(const Diamond& d, const SampleBox& box) {
  const double c[3] = {double(d.centre.x), double(d.centre.y), double(d.centre.z)};
  for (int i = 0; i < 3; ++i) {
    if (c[i] + d.h < box.min[i] || c[i] - d.h > box.max[i]) return false;
  }
  return true;
}

}  // namespace

Result<void> check_lod(const Lod& lod) {
  if (!std::isfinite(lod.error) || lod.error < 0) return misuse("the error of a level of detail must be a number that is not negative");
  if (lod.error_percent && !(*lod.error_percent >= 0 && *lod.error_percent <= 100)) return misuse("the error percent must be a number from 0 to 100");
  if (lod.roi) {
    for (int i = 0; i < 3; ++i) {
      if (!std::isfinite(lod.roi->min[i]) || !std::isfinite(lod.roi->max[i])) return misuse("the corners of the region of interest must be finite");
      if (!(lod.roi->min[i] <= lod.roi->max[i])) return misuse("the region of interest needs its lower corner first: X0 Y0 Z0 X1 Y1 Z1");
    }
  }
  return {};
}

double error_of(const Lod& lod, const Description& description) {
  return lod.error_percent ? *lod.error_percent / 100 * description.max_error : lod.error;
}

Criterion criterion_of(const Lod& lod, const Description& description) {
  const double threshold = error_of(lod, description);
  if (!lod.roi) {
    if (threshold == 0) return [](const Diamond&, double) { return true; };  // every update, also those whose error is 0
    return [threshold](const Diamond&, double error) { return error > threshold; };
  }
  SampleBox box{};
  const Grid& g = description.grid;
  for (int i = 0; i < 3; ++i) {
    box.min[i] = (lod.roi->min[i] - g.origin[i]) / g.spacing[i];
    box.max[i] = (lod.roi->max[i] - g.origin[i]) / g.spacing[i];
    // Beyond the samples there is nothing to refine.
    if (box.min[i] > g.dims[i] - 1) box.min[i] = std::numeric_limits<double>::infinity();
    if (box.max[i] < 0) box.max[i] = -std::numeric_limits<double>::infinity();
  }
  return [threshold, box](const Diamond& d, double error) { return (threshold == 0 || error > threshold) && meets(d, box); };
}

SplitSet select(const SupercubeSet& set, const std::function<double(UpdateIndex)>& error, const Criterion& wants) {
  SplitSet chosen(set.size());
  set.for_each_up([&](const Place& p) {
    const Diamond d(set.centre(p));
    if (!chosen.contains(p.index)) {
      if (!wants(d, error(p.index))) return;
      chosen.insert(p.index);
    }
    for (int k = 0; k < d.row->parents; ++k) {
      const Vertex c = d.parent(k);
      if (c.x < 0 || c.y < 0 || c.z < 0) continue;
      if (const auto parent = set.find(c)) chosen.insert(parent->index);
    }
  });
  return chosen;
}

SplitSet select(const IntervalVolume& volume, const Lod& lod) {
  if (lod.roi) {
    return select(
        volume.set(), [&volume](UpdateIndex i) { return double(volume.error(i)); }, criterion_of(lod, volume.description()));
  }
  // Saturated errors are closed as they are, and ascend with their level.
  const double threshold = error_of(lod, volume.description());
  unsigned level = 0;
  while (threshold > 0 && level < volume.error_levels().size() && volume.error_levels()[level] <= threshold) ++level;
  SplitSet chosen(volume.size());
  const auto bricks = volume.set().bricks();
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    if (volume.brick_error_level(b) < level) continue;
    const UpdateIndex end = b + 1 < bricks.size() ? bricks[b + 1].first : volume.size();
    for (UpdateIndex i = bricks[b].first; i < end; ++i) {
      if (volume.error_level(i) >= level) chosen.insert(i);
    }
  }
  return chosen;
}

std::vector<UpdateIndex> in_order(const IntervalVolume& volume, const SplitSet& updates) {
  // A counting sort by error level over the coarse to fine order.
  std::vector<std::uint32_t> begin(kErrorLevels + 1, 0);
  for (UpdateIndex i = 0; i < volume.size(); ++i) {
    if (updates.contains(i)) ++begin[kErrorLevels - volume.error_level(i)];
  }
  for (int k = 0; k < kErrorLevels; ++k) begin[k + 1] += begin[k];
  std::vector<UpdateIndex> order(begin[kErrorLevels]);
  volume.set().for_each_down([&](const Place& p) {
    if (updates.contains(p.index)) order[begin[kErrorLevels - 1 - volume.error_level(p.index)]++] = p.index;
  });
  return order;
}

}  // namespace intervale
