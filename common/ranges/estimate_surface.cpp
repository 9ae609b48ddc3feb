#include "common/ranges/estimate_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/ivm/split_lattice.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// How far updates of each class move the surface at most, in half widths of a diamond of class 0: diamonds of the other
// classes are smaller, and nearer to the values that they lie between.
constexpr std::array kReach{0.8, 0.5, 0.3};
// Likewise, of any class, where both ends of the spine are on the same side of the surface, and the centre on the other:
// the surface reaches the centre, however small the change of the value is.
constexpr double kAcrossReach = 1;
// Likewise, where none of the diamond's vertices is on the other side of the surface: it makes a piece of its own.
constexpr double kPieceReach = 2;
// So many surface points, each a square of the least spacing, come nearer by an update of class 0 and scale 0.
constexpr double kPoints = 20;

// What updates of one scale and class can do at most, in world units and in squares of the least spacing. width: of a
// diamond with h = 1.
struct Most {
  double width = 0, piece = 0, across = 0, distance = 0, removed = 0;
};

// What is removed goes with the area of the diamond's surface and the square of its width: with its volume to the 4/3.
Most most_of(const Grid& grid, int scale, std::size_t cls) {
  const Vec3 spacing = grid.affine.spacing();
  const double width = diamond_width(grid), unit = std::min({spacing[0], spacing[1], spacing[2]}), reach = width / 2 * std::exp2(scale);
  return {width, kPieceReach * reach, kAcrossReach * reach, kReach[cls] * reach,
          kPoints * width * width / (unit * unit) * std::pow(std::exp2(3.0 * scale - double(cls)), 4.0 / 3)};
}

struct Estimates {
  std::array<std::uint8_t, kSlots> distances{}, slopes{};  // by slot
  double ratio = 0;                                        // the greatest of a distance to its error
};

// Adds those of one class.
template <int Class>
void add_estimates(const IntervalVolume& volume, const SplitLattice& lattice, const CountingKeys& counts, SupercubeIndex s, UpdateIndex first,
                   std::uint64_t slots, const Most& most, Estimates& estimates) {
  const ValueFormat& format = volume.description().format;
  VertexKeys around;
  for (const Slot slot : set_bits<Slot>(slots & kSlotsOfClass[Class])) {
    const KeySpan span = lattice.gather<Class>(slot, around);
    const UpdateIndex i = first + count_below(volume.set().occupancy()[s], slot);
    const double error = volume.error(i);
    if (error == 0) continue;
    double distance = most.piece, part = 1;
    if (counts(span.least, span.greatest)) {
      const double difference = format.value(span.greatest) - format.value(span.least);
      const ValueKey centre = volume.key(i);
      const double own = format.value(centre) - (format.value(around[0]) / 2 + format.value(around[1]) / 2);
      const auto [low, high] = std::minmax(around[0], around[1]);
      const bool across = !counts(low, high) && counts(std::min(low, centre), std::max(high, centre));
      distance = across ? most.across : most.distance * std::min(error / difference, 1.0);
      part = std::min(std::abs(own) / difference, 1.0);
    }
    estimates.distances[slot] = distance_at_least(distance, most.width);
    estimates.slopes[slot] = std::uint8_t(slope_of(part * part * most.removed));
    estimates.ratio = std::max(estimates.ratio, distance / error);
  }
}

}  // namespace

EstimatedSurface estimate_surface(const IntervalVolume& volume, const CountingKeys& counts, BrickIndex brick,
                                  std::span<const std::uint64_t> relevant) {
  const SupercubeSet& set = volume.set();
  const Grid& grid = volume.description().grid;
  const int scale = scale_of_key(set.bricks()[brick].key);
  const std::array most{most_of(grid, scale, 0), most_of(grid, scale, 1), most_of(grid, scale, 2)};
  const double unit = error_to_distance_unit(grid, volume.description().max_error);
  EstimatedSurface result;
  std::size_t updates = 0;
  for (const std::uint64_t slots : relevant) updates += std::size_t(std::popcount(slots));
  result.of_updates.distances.reserve(updates);
  result.of_updates.slopes.reserve(updates);
  result.to_distance.reserve(relevant.size());
  SplitLattice lattice(volume);
  set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
    const std::size_t n = result.to_distance.size();
    Estimates estimates;
    if (const std::uint64_t slots = relevant[n]; slots != 0) {
      lattice.move_to(key);
      (void)lattice.splittable(slots);
      const UpdateIndex first = set.first(brick, s);
      add_estimates<0>(volume, lattice, counts, s, first, slots, most[0], estimates);
      add_estimates<1>(volume, lattice, counts, s, first, slots, most[1], estimates);
      add_estimates<2>(volume, lattice, counts, s, first, slots, most[2], estimates);
    }
    result.to_distance.push_back(ErrorToDistance::at_least(estimates.ratio, unit));
    for (const Slot slot : set_bits<Slot>(relevant[n])) {
      result.of_updates.distances.push_back(estimates.distances[slot]);
      result.of_updates.slopes.push_back(scale > kTopScale ? std::uint8_t(kMaxSlope) : estimates.slopes[slot]);
    }
  });
  return result;
}

EstimateBound bound_of_estimates(const Grid& grid, int scale) {
  const Most most = most_of(grid, scale, 0);
  return {distance_of(distance_at_least(most.piece, most.width), most.width), std::uint8_t(scale > kTopScale ? kMaxSlope : slope_of(most.removed))};
}

}  // namespace intervale
