// The supercubes around one, where its diamonds' vertices, parents, edges and children are found: one table, and one
// lookup.
//
// Every vertex of a diamond is itself the centre of a diamond that was split before, or a corner of the domain. Every
// edge came into being when the younger of its ends was inserted: it is one of that diamond's subdivision edges. So a
// diamond finds everything around it in its vertices' updates. Where those are kept follows from the diamond's slot and
// from the parity of its supercube's position: in one of the 27 supercubes of the same scale, in one of 8 of the next
// coarser scale, or, for a vertex that is 0 modulo 4h, at one of the 8 corners of the supercube. Children are of the
// same scale, or in one of 27 supercubes of the next finer one.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#include "common/diamond/diamond.h"
#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/util/bits.h"

namespace intervale {

// The number of a neighbour, seen from a supercube at position P whose cells are 4h wide.
//   kSame + (x + 1) + 3 (y + 1) + 9 (z + 1):  at P + (x, y, z), of the same scale; x, y, z in {-1, 0, 1}
//   kCoarser + x + 2 y + 4 z:                 at P / 2 + (x, y, z), of the next coarser scale; x, y, z in {0, 1}
//   kCorner + x + 2 y + 4 z:                  with the vertex 4h (P + (x, y, z)), of any scale; x, y, z in {0, 1}
//   kFiner + (x + 1) + 3 (y + 1) + 9 (z + 1): at 2 P + (x, y, z), of the next finer scale; x, y, z in {-1, 0, 1}
inline constexpr int kSame = 0, kCoarser = 27, kCorner = 35, kFiner = 43, kNeighbours = 70;
inline constexpr int kHere = 13;  // the supercube itself

// A diamond around another one.
struct Link {
  std::uint8_t where = 0;  // the neighbour that holds it
  Slot slot;               // in that supercube; 0 for a corner, whose slot depends on the supercube's position
};

// What is around the diamond in one slot.
struct Links {
  std::array<Link, kMaxVertices> vertex{};         // by local vertex
  std::array<std::uint8_t, kMaxParents> parent{};  // local numbers of those vertices that are parents
  struct Edge {
    std::uint8_t owner = 0;  // local number of the younger end
    std::uint8_t other = 0;  // the older end's local number in the owner's diamond
  };
  std::array<Edge, kMaxEdges> edge{};      // by local edge
  std::array<Link, kMaxChildren> child{};  // by number of the child
};

// Row for a slot of a supercube whose position has the parities p = (x & 1) + 2 (y & 1) + 4 (z & 1). Computed at first
// use.
using LinkTable = std::array<std::array<Links, kSlots>, 8>;
[[nodiscard]] const LinkTable& link_table();
[[nodiscard]] inline unsigned parity_of(Vertex position) {
  return unsigned(position.x & 1) | unsigned(position.y & 1) << 1 | unsigned(position.z & 1) << 2;
}

// A neighbour. Outside the domain the position or the scale is negative.
struct SupercubePlace {
  int scale = 0;
  Vertex position;
  Slot slot{};  // of a corner's vertex
  [[nodiscard]] bool exists() const { return (scale | position.x | position.y | position.z) >= 0; }
};
inline constexpr int kOriginScale = 32;  // scale_of((0, 0, 0)): that corner of the domain is in no supercube
[[nodiscard]] SupercubePlace neighbour_at(int where, int scale, Vertex position);

// Whether all diamonds of a supercube lie inside the box: they reach from h before its corner to 4 h behind.
[[nodiscard]] inline bool is_interior(const Domain& domain, int scale, Vertex p) {
  const auto corner = [scale](std::int32_t cells, std::int32_t more) { return (cells * 4 + more) * (std::int32_t(1) << scale); };
  return domain.contains({corner(p.x, -1), corner(p.y, -1), corner(p.z, -1)}) && domain.contains({corner(p.x, 4), corner(p.y, 4), corner(p.z, 4)});
}

// Looks up the neighbours of one supercube at a time, each at most once until it moves. Finder says how supercubes are
// found:
//   Found                      what is known of one; a pointer is never null
//   void move_to(scale, position)
//   Found find(where, place)   of the neighbour `where` of the supercube last moved to; place: its scale and position.
//                              Not called for places with negative coordinates
//   Found none()               for what is not there
//   bool kImmutable            whether what it finds never changes: moving to the same supercube keeps what was found
template <class Finder>
class SupercubeNeighbours {
 public:
  using Found = typename Finder::Found;
  template <class... Arguments>
  explicit SupercubeNeighbours(Arguments&&... arguments) : finder_(std::forward<Arguments>(arguments)...) {}

  void move_to(SupercubeKey key) {
    if constexpr (Finder::kImmutable) {
      if (key == key_) return;
    }
    move_to(scale_of_key(key), position_of_key(key));
    key_ = key;
  }
  void move_to(int scale, Vertex position) {
    key_ = ~SupercubeKey(0);
    scale_ = scale;
    position_ = position;
    links_ = &link_table()[parity_of(position)];
    if constexpr (kIsPointer) {
      found_.fill(nullptr);
    } else {
      known_ = {};
    }
    finder_.move_to(scale, position);
  }
  [[nodiscard]] int scale() const { return scale_; }
  [[nodiscard]] Vertex position() const { return position_; }
  [[nodiscard]] const Links& links(Slot slot) const { return (*links_)[std::size_t(slot)]; }
  [[nodiscard]] std::span<const Link> children(Slot slot) const {
    return std::span(links(slot).child).first(diamond_type(kTypeOfSlot[std::size_t(slot)]).children);
  }

  // Valid until it moves.
  [[nodiscard]] const Found& at(int where) {
    if (!is_known(where)) look_up(where);
    return found_[std::size_t(where)];
  }
  struct Diamond {
    const Found& supercube;
    Slot slot;
    [[nodiscard]] auto index() const { return supercube.index(slot); }
    [[nodiscard]] Place place() const { return supercube.place(slot); }
  };
  [[nodiscard]] Diamond at(Link link) {
    const Found& found = at(int(link.where));
    return {found, Slot(link.slot | corner_slot_[link.where])};
  }
  // Sets what is found of the supercube itself: looked up elsewhere, or come into being since.
  void set_here(const Found& found) { keep(kHere, found); }

 private:
  void look_up(int where) {
    const SupercubePlace place = neighbour_at(where, scale_, position_);
    corner_slot_[std::size_t(where)] = place.slot;
    keep(where, place.exists() ? finder_.find(where, place) : finder_.none());
  }
  // A pointer is null until it is looked up: one load fewer on the front's hottest path. Any other Found has a bit.
  static constexpr bool kIsPointer = std::is_pointer_v<Found>;
  [[nodiscard]] bool is_known(int where) const {
    if constexpr (kIsPointer) {
      return found_[std::size_t(where)] != nullptr;
    } else {
      return (known_[std::size_t(where) / 64] >> (where % 64) & 1) != 0;
    }
  }
  void keep(int where, const Found& found) {
    if constexpr (!kIsPointer) known_[std::size_t(where) / 64] |= std::uint64_t(1) << (where % 64);
    found_[std::size_t(where)] = found;
  }

  Finder finder_;
  SupercubeKey key_ = ~SupercubeKey(0);
  int scale_ = 0;
  Vertex position_;
  const std::array<Links, kSlots>* links_ = nullptr;
  std::array<std::uint64_t, 2> known_{};         // a bit for each neighbour looked up; unused for pointers
  std::array<Found, kNeighbours> found_;         // unset until it moves: some front cursors look at one supercube only
  std::array<Slot, kNeighbours> corner_slot_{};  // of a corner's vertex; 0 elsewhere
};

// Finds the supercubes of a set. Bricks that were found stay known while it moves within one brick, so it is fastest
// along ascending keys.
class SetFinder {
 public:
  static constexpr bool kImmutable = true;
  // A supercube of the set; occupancy is 0 if it is not in the set.
  struct Found {
    SupercubeKey key = 0;
    std::uint64_t occupancy = 0;
    BrickIndex brick;
    SupercubeIndex supercube;
    UpdateIndex first;  // number of its first diamond
    [[nodiscard]] bool has(Slot slot) const { return (occupancy >> slot & 1) != 0; }
    [[nodiscard]] UpdateIndex index(Slot slot) const { return first + count_below(occupancy, slot); }
    [[nodiscard]] Place place(Slot slot) const { return {key, brick, supercube, slot, index(slot)}; }
  };

  explicit SetFinder(const SupercubeSet& set) : set_(set) {}  // which must outlive it
  void move_to(int scale, Vertex position);
  [[nodiscard]] Found find(int where, const SupercubePlace& place);
  [[nodiscard]] static Found none() { return {}; }
  // The supercube at a position in a brick of the set.
  [[nodiscard]] Found find_in(BrickIndex brick, Vertex p) const {
    constexpr std::array<std::uint8_t, 4> kSpread{0, 1, 8, 9};
    const unsigned bit = kSpread[std::size_t(p.x & 3)] | unsigned(kSpread[std::size_t(p.y & 3)]) << 1 | unsigned(kSpread[std::size_t(p.z & 3)]) << 2;
    const SupercubeSet::Brick& b = set_.bricks()[brick];
    if (!(b.mask >> bit & 1)) return none();
    const SupercubeIndex s = b.first_supercube + count_below(b.mask, int(bit));
    return {b.key + bit, set_.occupancy()[s], brick, s, set_.first(brick, s)};
  }

 private:
  static constexpr BrickIndex kUnknown{~std::uint32_t(0)}, kNone{kUnknown - 1};
  [[nodiscard]] BrickIndex& brick_at(int where, Vertex in_bricks);

  const SupercubeSet& set_;
  int scale_ = -1;                       // of the brick last moved to
  Vertex brick_;                         // its position, in bricks
  std::array<BrickIndex, 27> same_{};    // bricks around that one
  std::array<BrickIndex, 8> coarser_{};  // and of the next coarser scale, from its own half position on
  std::array<BrickIndex, 64> finer_{};   // and of the next finer one, from one before its double position on
  bool finer_is_reset_ = false;
};
using SetNeighbours = SupercubeNeighbours<SetFinder>;

// Calls visit(parent), a SetNeighbours::Diamond, for those parents of a diamond that are in the set; `around` moves to
// its supercube. Fastest along ascending keys.
template <class Visit>
void for_each_parent(SetNeighbours& around, SupercubeKey key, Slot slot, Visit&& visit) {
  around.move_to(key);
  const Links& links = around.links(slot);
  for (int k = 0; k < diamond_type(kTypeOfSlot[slot]).parents; ++k) {
    const auto parent = around.at(links.vertex[links.parent[k]]);
    if (parent.supercube.has(parent.slot)) visit(parent);
  }
}

// Which of the diamonds named can be merged, finest first: calls merge(group, slot) for each that is split and by then
// has no split child. A child is one by its place, whether it was handed tetrahedra or not, so that a client's front
// and its server's plan agree. groups: keys strictly ascending. split_slots(Found): of a supercube.
template <class Finder, class SplitSlots, class Merge>
void merge_finest_first(std::span<const SlotGroup> groups, SupercubeNeighbours<Finder>& around, const SplitSlots& split_slots, const Merge& merge) {
  const auto has_split_child = [&](Slot slot) {
    for (const Link link : around.children(slot)) {
      const auto child = around.at(link);
      if (split_slots(child.supercube) >> child.slot & 1) return true;
    }
    return false;
  };
  for_each_finest_first(groups, [&](const SlotGroup& group, std::uint64_t slots) {
    around.move_to(group.key);
    for (const Slot slot : set_bits<Slot>(slots & split_slots(around.at(kHere)))) {
      if (!has_split_child(slot)) merge(group, slot);
    }
  });
}

}  // namespace intervale
