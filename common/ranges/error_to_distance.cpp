#include "common/ranges/error_to_distance.h"

#include <algorithm>
#include <bit>

#include "common/ivm/saturate.h"
#include "common/ranges/surface_deviation.h"
#include "common/ranges/update_slopes.h"

namespace intervale {
namespace {

// For surface points between those that are measured, and for points of the coarse mesh: some are farther from the surface
// than any point of it is from the mesh.
constexpr double kMargin = 1.35;

}  // namespace

// An object error is half of the deviation, but no less than twice the mean deviation of surface points, so that 99 % of
// them are within it also where all of a surface moves alike, as with labels.
SurfaceErrors measure_error_to_distance(const Volume& volume, const Range& range, const Domain& domain, const SupercubeSet& set,
                                        const std::function<double(UpdateIndex)>& error_of, double max_error, bool with_distances,
                                        const ParallelFor& parallel) {
  SurfaceDeviation deviation = surface_deviation(volume, range, domain, set, with_distances, parallel);
  saturate(set, deviation.largest, domain.levels(), parallel);
  if (with_distances) saturate(set, deviation.farthest, domain.levels(), parallel);
  const double unit = error_to_distance_unit(volume.grid, max_error);
  SurfaceErrors result{std::vector<ErrorToDistance>(set.supercubes()),
                       update_slopes(set, deviation.removed, domain.levels(), deviation.top_scale, parallel),
                       std::vector<std::uint8_t>(with_distances ? set.size() : 0)};
  parallel(set.bricks().size(), [&](std::size_t b) {
    const BrickIndex brick{std::uint32_t(b)};
    set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      const UpdateIndex first = set.first(brick, s), end = first + std::popcount(set.occupancy()[s]);
      const double width = diamond_width(volume.grid) * double(1 << scale_of_key(key));
      double furthest = 0, ratio = 0;
      for (UpdateIndex i = first; i < end; ++i) {
        const double error = error_of(i);
        if (error == 0) continue;
        furthest = std::max(furthest, double(deviation.largest[i]));
        ratio = std::max(ratio, double(deviation.largest[i]) / error);
      }
      const double share = furthest > 0 ? std::clamp(2 * double(deviation.mean[s]) / furthest, 0.5, 1.0) : 1;
      for (UpdateIndex i = with_distances ? first : end; i < end; ++i) {
        if (error_of(i) > 0) result.distances[i] = distance_at_least(kMargin * share * double(deviation.farthest[i]), diamond_width(volume.grid));
      }
      constexpr double kRounding = 1e-6;
      result.to_distance[s] = ErrorToDistance::at_least(share * ratio, unit, furthest > width * (1 + kRounding));
    });
  });
  return result;
}

}  // namespace intervale
