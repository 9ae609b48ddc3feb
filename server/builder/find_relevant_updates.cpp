#include "server/builder/find_relevant_updates.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "common/ivm/relevant_slots.h"
#include "common/patch/key_sides.h"
#include "common/util/bits.h"
#include "server/builder/all_cores.h"
#include "server/builder/error_to_distance.h"
#include "server/builder/estimate_distances.h"

namespace intervale {
namespace {

// The field of an interval volume, and a range of it. Samples that the volume lacks are 0.
struct RangeOfField {
  Volume volume;
  Range range;
};

// Puts number(key) at each sample.
template <class T, class Number>
void fill(const IntervalVolume& from, std::vector<std::byte>& bytes, const Number& number) {
  const Domain& domain = from.domain();
  const auto row = std::size_t(domain.last().x) + 1, slice = row * (std::size_t(domain.last().y) + 1);
  const auto put = [&](Vertex v, ValueKey key) {
    const Vertex s = domain.clamp(v);
    const T sample = number(key);
    std::memcpy(&bytes[(std::size_t(s.z) * slice + std::size_t(s.y) * row + std::size_t(s.x)) * sizeof(T)], &sample, sizeof(T));
  };
  const Diamond root(domain.root());
  for (int v = 0; v < kRootVertices; ++v) put(root.vertex(v), from.description().corners[std::size_t(v)]);
  // Where the box clamps several centres to a sample, all of them have its key.
  for (BrickIndex brick{0}; brick < from.set().bricks().size(); ++brick) {
    from.set().for_each_in_brick(brick, ~std::uint64_t(0), [&](const Place& p) { put(SupercubeSet::centre(p), from.key(p.index)); });
  }
}

// Keys of one or two bytes stand for the samples themselves: distances are the same in any unit.
RangeOfField field_of(const IntervalVolume& from, const Range& range) {
  const Description& d = from.description();
  RangeOfField field{{d.name, d.grid, SampleType::f64, {}}, range};
  const unsigned width = from.keys().width();
  if (d.format.step == 0 || width > 2) {
    field.volume.bytes.resize(d.grid.sample_count() * sizeof(double));
    fill<double>(from, field.volume.bytes, [&](ValueKey key) { return d.format.value(key); });
    return field;
  }
  field.volume.bytes.resize(d.grid.sample_count() * width);
  field.volume.type = width == 1 ? SampleType::u8 : SampleType::u16;
  const KeySides sides(d.format, range);
  const auto in_keys = [&d](double bound, double least, double greatest) {
    return std::isinf(bound) ? bound : std::clamp(bound / d.format.step - double(d.format.first), least, greatest);
  };
  // Every key keeps its side.
  const auto inside = double(sides.first_inside()), above = double(sides.first_above());
  constexpr double kLess = 1 - 1e-6;
  field.range = {in_keys(range.alpha, inside - kLess, inside), in_keys(range.beta, above - 1, above - 1 + kLess)};
  if (field.range.alpha > field.range.beta) field.range.alpha = field.range.beta;
  if (width == 1) fill<std::uint8_t>(from, field.volume.bytes, [](ValueKey key) { return std::uint8_t(key); });
  if (width == 2) fill<std::uint16_t>(from, field.volume.bytes, [](ValueKey key) { return std::uint16_t(key); });
  return field;
}

std::vector<ErrorToDistance> measured(const IntervalVolume& volume, const Range& range, const std::vector<std::uint64_t>& slots) {
  const SupercubeSet& all = volume.set();
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  std::vector<std::uint8_t> steps;  // of those that are relevant
  std::vector<SupercubeIndex> number;
  for (BrickIndex brick{0}; brick < all.bricks().size(); ++brick) {
    all.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      if (slots[s] == 0) return;
      keys.push_back(key);
      occupancy.push_back(slots[s]);
      number.push_back(s);
      for (const Slot slot : set_bits<Slot>(slots[s])) {
        steps.push_back(std::uint8_t(volume.error_step(all.first(brick, s) + count_below(all.occupancy()[s], slot))));
      }
    });
  }
  const SupercubeSet relevant(keys, std::move(occupancy));
  const RangeOfField field = field_of(volume, range);
  const auto found = measure_error_to_distance(
      field.volume, field.range, volume.domain(), relevant, [&](UpdateIndex i) { return double(volume.error_steps()[steps[i]]); },
      volume.description().max_error);
  std::vector<ErrorToDistance> result(all.supercubes());
  for (std::size_t i = 0; i < number.size(); ++i) result[number[i]] = found[i];
  return result;
}

}  // namespace

std::vector<ShownRange> parts_of(const ShownRange& shown) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto [alpha, beta] = shown.range;
  std::vector<ShownRange> parts;
  if (shown.refine == Refine::uniform || (alpha == -kInfinity && beta == kInfinity)) parts.push_back(shown);
  if (alpha != -kInfinity) parts.push_back({{alpha, kInfinity}, Refine::boundary});
  if (beta != kInfinity) parts.push_back({{-kInfinity, beta}, Refine::boundary});
  return parts;
}

ShownRange between_keys(const ValueFormat& format, const ShownRange& shown) {
  const KeySides sides(format, shown.range);
  ShownRange result = shown;
  if (std::isfinite(shown.range.alpha) && sides.first_inside() <= format.last) result.range.alpha = format.value(ValueKey(sides.first_inside()));
  if (std::isfinite(shown.range.beta) && sides.first_above() > 0) result.range.beta = format.value(ValueKey(sides.first_above() - 1));
  return result.range.alpha <= result.range.beta ? result : shown;  // no key inside
}

std::shared_ptr<const RelevantUpdates> find_relevant_part(const IntervalVolume& volume, const ShownRange& part, Distances distances) {
  const UpdateErrors errors{volume.steps(), volume.error_steps()};
  std::vector<std::uint64_t> slots = relevant_slots(volume, part, on_all_cores);
  std::vector<ErrorToDistance> to_distance(volume.set().supercubes());
  if (part.refine == Refine::boundary && distances == Distances::estimated) to_distance = estimate_distances(volume, part.range, slots, on_all_cores);
  if (part.refine == Refine::boundary && distances == Distances::measured) to_distance = measured(volume, part.range, slots);
  return std::make_shared<const RelevantUpdates>(volume.description().grid, volume.set(), errors, ShownRanges{part}, std::move(slots),
                                                 std::move(to_distance));
}

std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown,
                                                             Distances distances) {
  if (shown.size() == 1 && shown.front() == volume->description().whole()) return {volume, &volume->relevant()};
  std::vector<std::shared_ptr<const RelevantUpdates>> each;
  for (const ShownRange& one : shown) {
    if (one == volume->description().whole()) {
      each.emplace_back(volume, &volume->relevant());
      continue;
    }
    for (const ShownRange& part : parts_of(one)) each.push_back(find_relevant_part(*volume, part, distances));
  }
  return std::make_shared<const RelevantUpdates>(united(*volume, each, distinct(shown)));
}

}  // namespace intervale
