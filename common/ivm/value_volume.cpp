#include "common/ivm/value_volume.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "common/diamond/supercube_neighbours.h"
#include "common/util/bits.h"

namespace intervale {

std::uint64_t updated_slots(const Domain& domain, int scale, Vertex position) {
  if (is_interior(domain, scale, position)) return (std::uint64_t(1) << kSlots) - 1;
  const std::int32_t most = 1 << domain.levels();
  std::uint64_t slots = 0;
  for (Slot slot{0}; slot < kSlots; ++slot) {
    const Diamond d(centre_of(scale, position, slot), scale, kTypeOfSlot[slot]);
    if (d.centre.x > most || d.centre.y > most || d.centre.z > most) continue;
    if (domain.tets(d) != 0 && !domain.is_noop(d)) slots |= std::uint64_t(1) << slot;
  }
  return slots;
}

namespace {

// Calls visit(position) for those supercubes of a scale that may have diamonds in the box.
template <class Visit>
void for_each_supercube(const Domain& domain, int scale, const Visit& visit) {
  const Vertex last = last_supercube(domain, scale);
  for (Vertex p; p.z <= last.z; ++p.z) {
    for (p.y = 0; p.y <= last.y; ++p.y) {
      for (p.x = 0; p.x <= last.x; ++p.x) visit(p);
    }
  }
}

// The diamonds of those supercubes of scales from `finest` on that are wanted.
template <class Wanted>
SupercubeSet diamonds_of(const Domain& domain, int finest, const Wanted& wanted, const ParallelFor& parallel) {
  std::vector<std::pair<SupercubeKey, std::uint64_t>> found;
  for (int scale = finest; scale < domain.levels(); ++scale) {
    for_each_supercube(domain, scale, [&](Vertex p) {
      if (p.x == 0) may_stop(parallel);
      if (!wanted(scale, p)) return;
      if (const std::uint64_t slots = updated_slots(domain, scale, p)) found.emplace_back(supercube_key(scale, p), slots);
    });
  }
  std::sort(found.begin(), found.end());
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  for (const auto& [key, slots] : found) {
    keys.push_back(key);
    occupancy.push_back(slots);
  }
  return {keys, std::move(occupancy)};
}

}  // namespace

ValueVolume::ValueVolume(Parts parts) : parts_(std::move(parts)), domain_(parts_.description.grid.dims) {}

std::size_t ValueVolume::memory_bytes() const {
  std::size_t bytes = description().format.memory_bytes() + parts_.set.memory_bytes() + parts_.keys.memory_bytes() + parts_.error_levels.size();
  for (const ChannelKeys& channel : parts_.channel_keys) {
    for (const ValueKeys& keys : channel) bytes += keys.memory_bytes();
  }
  return bytes;
}

double ValueVolume::error_of_level(double max_error, ErrorLevel level) {
  if (level == 0) return 0;
  return std::ldexp(max_error, level - (kErrorLevels - 1));
}

ErrorLevel ValueVolume::level_of_error(double max_error, double error) {
  if (!(error > 0)) return 0;
  if (error >= max_error) return kErrorLevels - 1;
  // error <= max_error * 2^(level - (kErrorLevels - 1)), by the bits of a double.
  constexpr int kFraction = 52, kBias = 1023;
  const auto ratio = bits_as<std::uint64_t>(error / max_error);
  const bool is_power = (ratio & ((std::uint64_t(1) << kFraction) - 1)) == 0;
  return ErrorLevel(std::clamp(kErrorLevels - 1 + int(ratio >> kFraction) - kBias + int(!is_power), 1, kErrorLevels - 1));
}

Vertex last_supercube(const Domain& domain, int scale) {
  // A diamond reaches h from its centre.
  const auto positions = [&](std::int32_t last) { return std::min(last + (1 << scale), 1 << domain.levels()) >> (scale + 2); };
  return {positions(domain.last().x), positions(domain.last().y), positions(domain.last().z)};
}

SupercubeSet all_diamonds(const Domain& domain, const ParallelFor& parallel, int finest) {
  return diamonds_of(
      domain, finest, [](int, Vertex) { return true; }, parallel);
}

SupercubeSet some_diamonds(const Domain& domain, const std::function<bool(int scale, Vertex position)>& wanted, const ParallelFor& parallel) {
  return diamonds_of(domain, 0, wanted, parallel);
}

// Which diamonds have an update depends on what clamping does on each axis, and that on one coordinate alone.
std::uint64_t count_diamonds(const Domain& domain, int scale, Vertex first, Vertex last) {
  const std::int32_t h = std::int32_t(1) << scale, most = std::int32_t(1) << domain.levels();
  const std::array<std::array<std::int32_t, 2>, 3> ends{{{first.x, last.x}, {first.y, last.y}, {first.z, last.z}}};
  // By axis, by the centre's place in its supercube, and by what Domain::squeezed() tells of it.
  std::array<std::array<std::array<std::uint64_t, 4>, 4>, 3> coordinates{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::int32_t p = ends[axis][0]; p <= ends[axis][1]; ++p) {
      for (std::int32_t place = 0; place < 4; ++place) {
        const std::int32_t c = (p * 4 + place) << scale;
        if (c <= most) ++coordinates[axis][std::size_t(place)][domain.squeezed(int(axis), c, h)];
      }
    }
  }
  std::uint64_t count = 0;
  for (Slot slot{0}; slot < kSlots; ++slot) {
    const Vertex place = centre_of(0, {}, slot);
    const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
    const auto &x = coordinates[0][std::size_t(place.x)], &y = coordinates[1][std::size_t(place.y)], &z = coordinates[2][std::size_t(place.z)];
    const std::size_t odd = place.x % 2 != 0 ? 0 : place.y % 2 != 0 ? 1 : 2;  // of class 2: the spine's axis
    for (unsigned k = 0; k < 64; ++k) {
      const std::array<unsigned, 3> squeezed{k & 3, k >> 2 & 3, k >> 4};
      const std::uint64_t diamonds = x[squeezed[0]] * y[squeezed[1]] * z[squeezed[2]];
      if (diamonds == 0 || Domain::tets(row, squeezed) == 0) continue;
      if (row.cls == 2 && h == 1 && squeezed[odd] != 0) continue;  // a no-op
      count += diamonds;
    }
  }
  return count;
}

std::uint64_t count_diamonds(const Domain& domain) {
  std::uint64_t count = 0;
  for (int scale = 0; scale < domain.levels(); ++scale) count += count_diamonds(domain, scale, {}, last_supercube(domain, scale));
  return count;
}

namespace {

constexpr std::int32_t kBrickSide = 4;  // supercubes

// Runs of so many supercubes on an axis that clamping treats alike: their number, and the first one's, from 0 on.
struct AlikeRuns {
  std::uint64_t count = 0;
  std::int32_t first = 0;
};
// side: supercubes, kBrickSide at most. last: the last one.
std::vector<AlikeRuns> alike_runs(const Domain& domain, int scale, int axis, std::int32_t last, std::int32_t side) {
  constexpr std::uint8_t kBeyond = 4;  // other than what Domain::squeezed() tells
  const std::int32_t most = std::int32_t(1) << domain.levels();
  std::map<std::array<std::uint8_t, 4 * kBrickSide>, AlikeRuns> runs;  // by what it does to each place
  for (std::int32_t run = 0; run <= last / side; ++run) {
    std::array<std::uint8_t, 4 * kBrickSide> squeezed{};
    squeezed.fill(kBeyond);
    for (std::int32_t place = 0; place < 4 * side; ++place) {
      const std::int32_t c = (run * 4 * side + place) << scale;
      if (c <= most && run * side + place / 4 <= last) squeezed[std::size_t(place)] = std::uint8_t(domain.squeezed(axis, c, 1 << scale));
    }
    AlikeRuns& alike = runs.try_emplace(squeezed, AlikeRuns{0, run}).first->second;
    ++alike.count;
  }
  std::vector<AlikeRuns> found;
  found.reserve(runs.size());
  for (const auto& [squeezed, alike] : runs) found.push_back(alike);
  return found;
}

// How many cubes of side x side x side supercubes of a scale have diamonds.
std::uint64_t count_cubes(const Domain& domain, int scale, std::int32_t side) {
  const Vertex last = last_supercube(domain, scale);
  const auto xs = alike_runs(domain, scale, 0, last.x, side), ys = alike_runs(domain, scale, 1, last.y, side),
             zs = alike_runs(domain, scale, 2, last.z, side);
  std::uint64_t count = 0;
  for (const AlikeRuns& z : zs) {
    for (const AlikeRuns& y : ys) {
      for (const AlikeRuns& x : xs) {
        const Vertex first{x.first * side, y.first * side, z.first * side};
        const Vertex end{std::min(first.x + side - 1, last.x), std::min(first.y + side - 1, last.y), std::min(first.z + side - 1, last.z)};
        if (count_diamonds(domain, scale, first, end) != 0) count += x.count * y.count * z.count;
      }
    }
  }
  return count;
}

}  // namespace

SetCounts count_supercubes(const Domain& domain) {
  SetCounts counts;
  for (int scale = 0; scale < domain.levels(); ++scale) {
    counts.bricks += count_cubes(domain, scale, kBrickSide);
    counts.supercubes += count_cubes(domain, scale, 1);
  }
  return counts;
}

std::size_t coarse_diamonds(const SupercubeSet& set) {
  const auto [first, end] = set.of_scale(0);
  return first == end ? set.size() : std::size_t(set.bricks()[first].first);
}

}  // namespace intervale
