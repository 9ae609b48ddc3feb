#include "common/ranges/estimate_distances.h"

#include <algorithm>
#include <cmath>

#include "common/codec/value_prediction.h"
#include "common/diamond/split_set.h"
#include "common/ivm/split_lattice.h"
#include "common/ivm/value_bounds.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

class Estimator {
 public:
  Estimator(const IntervalVolume& volume, const Range& range, const std::vector<std::uint64_t>& slots)
      : volume_(volume),
        format_(volume.description().format),
        counts_(KeySides(volume.description().format, range), Refine::boundary),
        slots_(slots),
        all_(volume.set().size()),
        unit_(error_to_distance_unit(volume.description().grid, volume.description().max_error)) {
    all_.insert_all();
  }

  void estimate(BrickIndex brick, std::vector<ErrorToDistance>& result) const {
    SplitLattice lattice(volume_, all_);
    const double width = diamond_width(volume_.description().grid) * double(1 << scale_of_key(volume_.set().bricks()[brick].key));
    volume_.set().for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      if (slots_[s] == 0) return;
      lattice.move_to(key);
      (void)lattice.splittable(volume_.set().occupancy()[s]);
      Largest largest;
      UpdateIndex next = volume_.set().first(brick, s);
      next = add<0>(lattice, s, next, width, largest);
      next = add<1>(lattice, s, next, width, largest);
      add<2>(lattice, s, next, width, largest);
      if (largest.error > 0) result[s] = ErrorToDistance::at_least(largest.distance / 2 / largest.error, unit_);
    });
  }

 private:
  struct Largest {
    double distance = 0, error = 0;
  };
  // The relevant diamonds of a class. next: the number of the first of the class.
  template <int Class>
  UpdateIndex add(const SplitLattice& lattice, SupercubeIndex s, UpdateIndex next, double width, Largest& largest) const {
    VertexKeys around;
    for (const Slot slot : set_bits<Slot>(volume_.set().occupancy()[s] & kSlotsOfClass[Class])) {
      const UpdateIndex i = next++;
      const double error = volume_.error(i);
      if ((slots_[s] >> slot & 1) == 0 || error == 0) continue;
      KeySpan span = lattice.gather<Class>(slot, around);
      double distance = 0;
      if (counts_(span.least, span.greatest)) {
        distance = std::min(error / (format_.value(span.greatest) - format_.value(span.least)), 1.0) * width;
      } else if (span.add(volume_.key(i)); counts_(span.least, span.greatest)) {
        distance = width;
      }
      largest = {std::max(largest.distance, distance), std::max(largest.error, error)};
    }
    return next;
  }

  const IntervalVolume& volume_;
  const ValueFormat& format_;
  CountingKeys counts_;
  const std::vector<std::uint64_t>& slots_;
  SplitSet all_;  // of the volume's updates
  double unit_;
};

}  // namespace

std::vector<ErrorToDistance> estimate_distances(const IntervalVolume& volume, const Range& range, const std::vector<std::uint64_t>& slots,
                                                const ParallelFor& parallel) {
  std::vector<ErrorToDistance> result(volume.set().supercubes());
  const Estimator estimator(volume, range, slots);
  parallel(volume.set().bricks().size(), [&](std::size_t brick) { estimator.estimate(BrickIndex(std::uint32_t(brick)), result); });
  return result;
}

}  // namespace intervale
