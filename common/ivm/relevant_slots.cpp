#include "common/ivm/relevant_slots.h"

#include <algorithm>
#include <array>
#include <bit>

#include "common/codec/value_prediction.h"
#include "common/diamond/parent_table.h"
#include "common/ivm/split_lattice.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// The words of a brick's supercubes, and of those ahead of them: descendants of the same scale are in no others.
class Neighbourhood {
 public:
  static constexpr int kSide = 5;
  [[nodiscard]] static bool holds(Vertex p) { return std::max({p.x, p.y, p.z}) < kSide; }
  [[nodiscard]] std::uint64_t& at(Vertex p) { return words_[std::size_t((p.z * kSide + p.y) * kSide + p.x)]; }

  // Adds the parents of those of a class.
  void add_parents(std::size_t cls) {
    const auto& table = parents_by_slot();
    constexpr std::array<int, ParentTable::kPlaces> kStep{0, 1, kSide, kSide * kSide};
    for (int z = 0, i = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x, ++i) {
          for (const Slot slot : set_bits<Slot>(words_[std::size_t(i)] & kSlotsOfClass[cls])) {
            for (std::size_t k = 0; k < table[slot].count; ++k) {
              const auto [parent, place] = table[slot].parent[k];
              if ((place == 1 && x == 0) || (place == 2 && y == 0) || (place == 3 && z == 0)) continue;
              words_[std::size_t(i - kStep[place])] |= std::uint64_t(1) << parent;
            }
          }
        }
      }
    }
  }

 private:
  std::array<std::uint64_t, std::size_t(kSide) * kSide * kSide> words_{};
};

// Where a supercube is in its brick, by the lowest six bits of its key.
const std::array<Vertex, 64>& places_in_brick() {
  static const auto kTable = [] {
    std::array<Vertex, 64> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = position_of_key(i);
    return table;
  }();
  return kTable;
}

// Which of the slots count. first: the number of the supercube's first update.
template <int Class>
std::uint64_t counting_of(const IntervalVolume& volume, const CountingKeys& counts, const SplitLattice& lattice, std::uint64_t slots,
                          UpdateIndex& next) {
  VertexKeys around;
  std::uint64_t word = 0;
  for (const Slot slot : set_bits<Slot>(slots & kSlotsOfClass[Class])) {
    KeySpan span = lattice.gather<Class>(slot, around);
    span.add(volume.key(next++));
    word |= std::uint64_t(counts(span.least, span.greatest)) << slot;
  }
  return word;
}

std::uint64_t counting_slots(const IntervalVolume& volume, const CountingKeys& counts, SplitLattice& lattice, SupercubeKey key,
                             std::uint64_t occupancy, UpdateIndex first) {
  lattice.move_to(key);
  (void)lattice.splittable(occupancy);
  std::uint64_t word = counting_of<0>(volume, counts, lattice, occupancy, first);
  word |= counting_of<1>(volume, counts, lattice, occupancy, first);
  word |= counting_of<2>(volume, counts, lattice, occupancy, first);
  return word;
}

}  // namespace

std::vector<std::uint64_t> counting_slots(const IntervalVolume& volume, const CountingKeys& counts) {
  const SupercubeSet& set = volume.set();
  std::vector<std::uint64_t> words;
  words.reserve(set.supercubes());
  SplitLattice lattice(volume);
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      words.push_back(counting_slots(volume, counts, lattice, key, set.occupancy()[s], set.first(b, s)));
    });
  }
  return words;
}

RelevantSlots::RelevantSlots(const IntervalVolume& volume, const ShownRange& shown, const ParallelFor& parallel)
    : volume_(volume),
      set_(volume.set()),
      bounds_(volume.bounds(parallel)),
      counts_(KeySides(volume.description().format, shown.range), shown.refine),
      first_fine_(set_.of_scale(0)[0]),
      counting_(set_.bricks().size() - first_fine_) {}

std::vector<std::uint64_t> RelevantSlots::with_ancestors(BrickIndex brick) const {
  if (!has_any(brick)) return none(brick);
  return without_lost(brick, brick < first_fine_ ? of_coarse(brick) : of_fine(brick));
}

std::vector<std::uint64_t> RelevantSlots::of(BrickIndex brick) const {
  if (!has_any(brick)) return none(brick);
  const Words* const known = brick < first_fine_ ? nullptr : counting_.find(brick - first_fine_);
  return without_lost(brick, known != nullptr ? *known : find_counting(brick));
}

RelevantSlots::Words RelevantSlots::none(BrickIndex brick) const { return Words(std::size_t(std::popcount(set_.bricks()[brick].mask))); }

RelevantSlots::Words RelevantSlots::without_lost(BrickIndex brick, Words words) const {
  const SupercubeIndex first = set_.bricks()[brick].first_supercube;
  for (std::size_t n = 0; n < words.size(); ++n) words[n] &= volume_.left(first + n);
  return words;
}

std::vector<std::uint64_t> RelevantSlots::of_coarse(BrickIndex brick) const {
  Words words;
  set_.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey) {
    words.push_back(0);
    if (!bounds_.is_relevant(counts_, s)) return;
    UpdateIndex next = set_.first(brick, s);
    for (const Slot slot : set_bits<Slot>(set_.occupancy()[s])) words.back() |= std::uint64_t(bounds_.is_relevant(counts_, next++)) << slot;
  });
  return words;
}

RelevantSlots::Words RelevantSlots::find_counting(BrickIndex brick) const {
  Words words;
  if (!has_any(brick)) return words;
  SplitLattice lattice(volume_);
  set_.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
    words.push_back(bounds_.is_relevant(counts_, s) ? counting_slots(volume_, counts_, lattice, key, set_.occupancy()[s], set_.first(brick, s)) : 0);
  });
  return words;
}

// Of a brick of scale 0.
const RelevantSlots::Words& RelevantSlots::fine_counting(BrickIndex brick) const {
  const Words* const known = counting_.find(brick - first_fine_);
  return known != nullptr ? *known : counting_.keep(brick - first_fine_, find_counting(brick)).value;
}

std::vector<std::uint64_t> RelevantSlots::of_fine(BrickIndex brick) const {
  const Vertex first = position_of_key(set_.bricks()[brick].key);
  const auto& places = places_in_brick();
  Neighbourhood around;
  for (std::int32_t i = 0; i < 7; ++i) {  // not the one ahead on all axes
    const Vertex ahead{i & 1, i >> 1 & 1, i >> 2};
    const auto other = i == 0 ? std::optional(brick) : set_.find_brick(0, {first.x / 4 + ahead.x, first.y / 4 + ahead.y, first.z / 4 + ahead.z});
    const Words* const words = other ? &fine_counting(*other) : nullptr;
    if (words == nullptr || words->empty()) continue;
    std::size_t n = 0;
    for (const int k : set_bits(set_.bricks()[*other].mask)) {
      const std::uint64_t word = (*words)[n++];
      const Vertex p = places[std::size_t(k)], at{p.x + 4 * ahead.x, p.y + 4 * ahead.y, p.z + 4 * ahead.z};
      if (Neighbourhood::holds(at)) around.at(at) = word;
    }
  }
  around.add_parents(2);
  around.add_parents(1);
  Words words;
  SupercubeIndex s = set_.bricks()[brick].first_supercube;
  for (const int k : set_bits(set_.bricks()[brick].mask)) words.push_back(around.at(places[std::size_t(k)]) & set_.occupancy()[s++]);
  return words;
}

}  // namespace intervale
