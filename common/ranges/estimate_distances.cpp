#include "common/ranges/estimate_distances.h"

#include <algorithm>

#include "common/util/bits.h"

namespace intervale {

std::vector<ErrorToDistance> estimate_distances(const IntervalVolume& volume, BrickIndex brick, std::span<const float> moves,
                                                std::span<const std::uint64_t> slots) {
  const SupercubeSet& set = volume.set();
  const Grid& grid = volume.description().grid;
  const double unit = error_to_distance_unit(grid, volume.description().max_error);
  const double width = diamond_width(grid) * double(1 << scale_of_key(set.bricks()[brick].key));
  std::vector<ErrorToDistance> result;
  set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey) {
    const std::size_t n = result.size();
    double error = 0;
    for (const Slot slot : set_bits<Slot>(moves[n] > 0 ? slots[n] : 0))
      error = std::max(error, double(volume.error(set.first(brick, s) + count_below(set.occupancy()[s], slot))));
    result.push_back(error > 0 ? ErrorToDistance::at_least(double(moves[n]) * width / 2 / error, unit) : ErrorToDistance());
  });
  return result;
}

}  // namespace intervale
