#include "common/ivm/split_lattice.h"

namespace intervale {

SplitLattice::Tables SplitLattice::make_tables() {
  Tables t;
  for (Slot slot{0}; slot < kSlots; ++slot) {
    const unsigned type = kTypeOfSlot[slot];
    const DiamondType& row = diamond_type(type);
    const std::array<int, 3> c{int(type & 3), int(type >> 2 & 3), int(type >> 4 & 3)};
    const auto point = [&c](Offset to) { return Point(point_of(c[0] + to.x, c[1] + to.y, c[2] + to.z)); };
    t.centre[slot] = point({});
    for (std::size_t axis = 0; axis < 3; ++axis) t.at[axis][std::size_t(c[axis])] |= std::uint64_t(1) << slot;
    for (std::size_t v = 0; v < kMaxVertices; ++v) t.vertex[slot][v] = point(row.vertex[v < row.vertices ? v : 0]);
    for (std::size_t k = 0; k < kMaxParents; ++k) {
      const Offset to = row.parent[k < row.parents ? k : 0];
      t.parent[slot][k] = point(to);
      while (row.vertex[t.parent_vertex[slot][k]] != to) ++t.parent_vertex[slot][k];
    }
    for (unsigned n = 0; n < 8; ++n) {
      bool behind = row.cls < 2, ahead = true;  // no vertex is of class 2 and the same scale
      for (unsigned k = 0; k < 3; ++k) {
        if ((n >> k & 1) == 0) continue;
        behind = behind && c[k] == 3;
        ahead = ahead && c[k] == 0;
      }
      bool uses = false;
      for (std::size_t v = 0; v < row.vertices; ++v) {
        const Offset to = row.vertex[v];
        uses = uses || (unsigned(c[0] + to.x < 0) | unsigned(c[1] + to.y < 0) << 1 | unsigned(c[2] + to.z < 0) << 2) == n;
      }
      t.users[n] |= std::uint64_t(uses) << slot;
      t.behind[n] |= std::uint64_t(behind) << slot;
      t.ahead[n] |= std::uint64_t(ahead) << slot;
    }
  }
  return t;
}

const SplitLattice::Tables& SplitLattice::tables() {
  static const Tables made = make_tables();
  return made;
}

SplitLattice::SplitLattice(const IntervalVolume& volume, const SplitSet* split)
    : volume_(volume),
      split_(split),
      coarser_(std::size_t(volume.domain().levels()) + 1, Coarser{.finder = SetFinder(volume.set())}),
      finder_(volume.set()) {
  const int levels = volume.domain().levels();
  Keys& corners = coarser_.back().keys;
  corners.fill(kNoKey);
  const Diamond root(volume.domain().root());
  for (int v = 0; v < kRootVertices; ++v) {
    const Vertex c = root.vertex(v);
    corners[std::size_t(point_of(c.x >> levels, c.y >> levels, c.z >> levels))] = volume.description().corners[std::size_t(v)];
  }
}

// Loads the points of coarser scales.
void SplitLattice::load_coarser(int scale, Vertex position, Keys& keys) {
  const Keys& even = coarser(scale + 1, {position.x >> 1, position.y >> 1, position.z >> 1}, parity_of(position));
  const Vertex first{2 * (position.x & 1), 2 * (position.y & 1), 2 * (position.z & 1)};
  keys.fill(kNoKey);
  for (int z = 0; z < 3; ++z) {
    for (int y = 0; y < 3; ++y) {
      const ValueKey* const from = &even[std::size_t(point_of(first.x, first.y + y, first.z + z))];
      ValueKey* const to = &keys[std::size_t(point_of(0, 2 * y, 2 * z))];
      to[0] = from[0];
      to[2] = from[1];
      to[4] = from[2];
    }
  }
}

// Loads the points of one supercube of the same scale, and returns the slots of those. neighbour: a bit for each axis;
// towards: -1 if it lies behind, 1 if it lies ahead. finder: at `from`.
std::uint64_t SplitLattice::load_neighbour(SetFinder& finder, const SupercubePlace& from, unsigned neighbour, int towards, Keys& keys) {
  const int x = towards * int(neighbour & 1), y = towards * int(neighbour >> 1 & 1), z = towards * int(neighbour >> 2);
  const SupercubePlace place{from.scale, {from.position.x + x, from.position.y + y, from.position.z + z}};
  if (!place.exists()) return 0;
  const SetFinder::Found found = finder.find(kHere + x + 3 * y + 9 * z, place);
  if (found.occupancy == 0) return 0;
  return load_slots(found, (towards < 0 ? tables_.behind : tables_.ahead)[neighbour], keys.data() + 4 * (point_of(x, y, z) - point_of(0, 0, 0)));
}

// Loads the keys of those of a supercube's split diamonds whose slots are used, and returns the slots of those. first: the
// point of its own corner.
std::uint64_t SplitLattice::load_slots(const SetFinder::Found& found, std::uint64_t used, ValueKey* first) const {
  const std::uint64_t slots = (split_ == nullptr ? found.occupancy : split_->slots(found.brick, found.key)) & used;
  switch (volume_.keys().width()) {
    case 1:
      load_keys<1>(found, slots, first);
      break;
    case 2:
      load_keys<2>(found, slots, first);
      break;
    case 3:
      load_keys<3>(found, slots, first);
      break;
    default:
      load_keys<4>(found, slots, first);
  }
  return slots;
}

template <unsigned Width>
void SplitLattice::load_keys(const SetFinder::Found& found, std::uint64_t slots, ValueKey* first) const {
  const std::uint8_t* const bytes = volume_.keys().bytes().data() + std::size_t(found.first) * Width;
  for (const Slot slot : set_bits<Slot>(slots)) {
    first[tables_.centre[slot]] = ValueKeys::read<Width>(bytes + std::size_t(count_below(found.occupancy, slot)) * Width);
  }
}

// half: of the finer supercube whose points are needed, a bit for each axis.
const SplitLattice::Keys& SplitLattice::coarser(int scale, Vertex position, unsigned half) {
  Coarser& here = coarser_[std::size_t(scale)];
  if (&here == &coarser_.back()) return here.keys;  // the corners of the domain
  if (here.position != position) {
    load_coarser(scale, position, here.keys);
    here.finder.move_to(scale, position);
    here.position = position;
    here.loaded = 0;
  }
  for (unsigned n = 0; n < 8; ++n) {
    if ((n & ~half) == 0 && (here.loaded >> n & 1) == 0) load_neighbour(here.finder, {scale, position}, n, 1, here.keys);
    here.loaded |= unsigned((n & ~half) == 0) << n;
  }
  return here.keys;
}

void SplitLattice::place_at(SupercubeKey key) {
  place_ = {scale_of_key(key), position_of_key(key)};
  is_interior_ = is_interior(volume_.domain(), place_.scale, place_.position);
  load_coarser(place_.scale, place_.position, keys_);
  finder_.move_to(place_.scale, place_.position);
}

// Loads the parents' places but the first, which is the supercube itself.
void SplitLattice::load_behind() {
  for (std::size_t k = 1; k < ParentTable::kPlaces; ++k) parents_[k] = load_neighbour(finder_, place_, kParentNeighbour[k], -1, keys_);
}

void SplitLattice::move_to(SupercubeKey key) {
  place_at(key);
  parents_[0] = load_neighbour(finder_, place_, kParentNeighbour[0], -1, keys_);
  load_behind();
}

void SplitLattice::move_to(const SlotGroup& group) {
  const SupercubeSet& set = volume_.set();
  const SetFinder::Found here{group.key, set.occupancy()[group.supercube], group.brick, group.supercube, set.first(group.brick, group.supercube)};
  place_at(group.key);
  parents_[0] = load_slots(here, tables_.behind[0], keys_.data());
  load_behind();
}

std::uint64_t SplitLattice::splittable(std::uint64_t slots) {
  border_ = 0;
  const std::uint64_t ready = is_interior_ ? splittable_inside(slots) : splittable_at_border(slots);
  for (const unsigned n : {3u, 5u, 6u}) {
    if ((ready & tables_.users[n]) != 0) load_neighbour(finder_, place_, n, -1, keys_);
  }
  return ready;
}

std::uint64_t SplitLattice::splittable_inside(std::uint64_t slots) const {
  std::uint64_t lacking = parent_table().lacking(parents_);
  const auto unsplit = [this](Point p) { return unsigned(keys_[p] == kNoKey); };
  for (const Slot slot : set_bits<Slot>(slots & kSlotsOfClass[0])) {
    const auto& parent = tables_.parent[slot];
    lacking |= std::uint64_t(unsplit(parent[0]) | unsplit(parent[1]) | unsplit(parent[2]) | unsplit(parent[3])) << slot;
  }
  return slots & ~lacking;
}

std::uint64_t SplitLattice::splittable_at_border(std::uint64_t slots) {
  const Tables& t = tables_;
  const Domain& domain = volume_.domain();
  const int scale = place_.scale;
  const Vertex p = place_.position;
  std::array<std::array<unsigned, 4>, 3> squeezed{};  // by axis and coordinate
  for (int i = 0; i < 4; ++i) {
    const auto on_axis = [&](int axis, std::int32_t at) { return domain.squeezed(axis, (4 * at + i) << scale, 1 << scale); };
    squeezed[0][std::size_t(i)] = on_axis(0, p.x);
    squeezed[1][std::size_t(i)] = on_axis(1, p.y);
    squeezed[2][std::size_t(i)] = on_axis(2, p.z);
    for (std::size_t axis = 0; axis < 3; ++axis) border_ |= squeezed[axis][std::size_t(i)] != 0 ? t.at[axis][std::size_t(i)] : 0;
  }
  std::uint64_t ready = splittable_inside(slots & ~border_);
  for (const Slot slot : set_bits<Slot>(slots & border_)) {
    const unsigned type = kTypeOfSlot[slot];
    const DiamondType& row = diamond_type(type);
    const std::array<unsigned, 3> here{squeezed[0][type & 3], squeezed[1][type >> 2 & 3], squeezed[2][type >> 4 & 3]};
    // A no-op: the spine of a class 2 diamond lies along its odd axis.
    if (scale == 0 && row.cls == 2 && here[(type & 1) != 0 ? 0 : (type >> 2 & 1) != 0 ? 1 : 2] != 0) continue;
    const unsigned tets = Domain::tets(row, here);
    const bool is_whole = tets + 1 == 1u << row.tets;
    exist_[slot] = is_whole ? (1u << row.vertices) - 1 : Domain::vertices(row, tets);
    bool all = tets != 0;
    for (std::size_t k = 0; k < kMaxParents; ++k) {
      const bool exists = (exist_[slot] >> t.parent_vertex[slot][k] & 1) != 0;
      all = all && (!exists || keys_[t.parent[slot][k]] != kNoKey);
    }
    ready |= std::uint64_t(all) << slot;
  }
  return ready;
}

void SplitLattice::replace_missing(Slot slot, VertexKeys& keys) const {
  const int count = diamond_type(kTypeOfSlot[slot]).vertices;
  if (exist_[slot] == (1u << count) - 1) return;
  for (int v = 0; v < count; ++v) {
    if ((exist_[slot] >> v & 1) == 0) keys[std::size_t(v)] = kNoKey;
  }
  fill_missing(keys, count);
}

}  // namespace intervale
