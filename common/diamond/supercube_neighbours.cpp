#include "common/diamond/supercube_neighbours.h"

#include <cassert>
#include <memory>

namespace intervale {
namespace {

// A point near a supercube, in units of h from its position; coordinates in [-1, 4].
struct Near {
  std::array<int, 3> at{};
  [[nodiscard]] bool all_multiples_of(int n) const { return (at[0] & (n - 1)) == 0 && (at[1] & (n - 1)) == 0 && (at[2] & (n - 1)) == 0; }
  // 0: a diamond of the same scale; 1: of the next coarser one; 2: of a scale yet coarser, or a corner of the domain.
  [[nodiscard]] int coarser() const { return !all_multiples_of(2) ? 0 : !all_multiples_of(4) ? 1 : 2; }
  // Ascends from old to young.
  [[nodiscard]] int youth() const {
    const int k = coarser();
    const int odd = (at[0] >> k & 1) + (at[1] >> k & 1) + (at[2] >> k & 1);
    return k == 2 ? 0 : 4 * (2 - k) + (3 - odd);
  }
};

Near near_of(unsigned type, Offset f) { return {{int(type & 3) + f.x, int(type >> 2 & 3) + f.y, int(type >> 4 & 3) + f.z}}; }

Link link_to(const Near& p, unsigned parity) {
  const int k = p.coarser();
  std::array<int, 3> cell{};
  unsigned type = 0;
  for (int i = 0; i < 3; ++i) {
    // Cells and types of the next coarser scale depend on which half of the coarser supercube this one is in.
    const int at = k == 0 ? p.at[i] : k == 1 ? int(parity >> i & 1) * 2 + p.at[i] / 2 : p.at[i];
    cell[i] = at >> 2;
    type |= unsigned(at & 3) << (2 * i);
  }
  if (k == 2) return {std::uint8_t(kCorner + cell[0] + 2 * cell[1] + 4 * cell[2]), {}};
  if (k == 1) return {std::uint8_t(kCoarser + cell[0] + 2 * cell[1] + 4 * cell[2]), kSlotOfType[type]};
  return {std::uint8_t(kSame + (cell[0] + 1) + 3 * (cell[1] + 1) + 9 * (cell[2] + 1)), kSlotOfType[type]};
}

// A child of class 2, a scale finer; in units of h / 2.
Link link_to_finer(unsigned type, Offset f) {
  const std::array<int, 3> at{2 * int(type & 3) + f.x, 2 * int(type >> 2 & 3) + f.y, 2 * int(type >> 4 & 3) + f.z};
  const unsigned child = unsigned(at[0] & 3) | unsigned(at[1] & 3) << 2 | unsigned(at[2] & 3) << 4;
  return {std::uint8_t(kFiner + ((at[0] >> 2) + 1) + 3 * ((at[1] >> 2) + 1) + 9 * ((at[2] >> 2) + 1)), kSlotOfType[child]};
}

// The steps to each neighbour: see kSame and those after it.
constexpr std::array<Offset, kNeighbours> kSteps = [] {
  std::array<Offset, kNeighbours> steps{};
  for (int i = 0; i < 27; ++i) {
    const Offset step{std::int8_t(i % 3 - 1), std::int8_t(i / 3 % 3 - 1), std::int8_t(i / 9 - 1)};
    steps[std::size_t(kSame + i)] = steps[std::size_t(kFiner + i)] = step;
  }
  for (int i = 0; i < 8; ++i) {
    const Offset step{std::int8_t(i & 1), std::int8_t(i >> 1 & 1), std::int8_t(i >> 2)};
    steps[std::size_t(kCoarser + i)] = steps[std::size_t(kCorner + i)] = step;
  }
  return steps;
}();

Links links_of(Slot slot, unsigned parity) {
  const unsigned type = kTypeOfSlot[slot];
  const DiamondType& row = diamond_type(type);
  Links links;
  std::array<Near, kMaxVertices> vertex;
  for (int v = 0; v < row.vertices; ++v) {
    vertex[v] = near_of(type, row.vertex[v]);
    links.vertex[v] = link_to(vertex[v], parity);
  }
  for (int e = 0; e < row.edges; ++e) {
    auto [other, owner] = edge_ends(e, row.belt);
    if (vertex[other].youth() > vertex[owner].youth()) std::swap(other, owner);
    assert(vertex[other].youth() < vertex[owner].youth() && "one end of an edge is the younger one, and never one of the oldest vertices");
    const int k = vertex[owner].coarser();
    const DiamondType& owner_row = diamond_type(kTypeOfSlot[links.vertex[owner].slot]);
    Offset to;
    to.x = std::int8_t((vertex[other].at[0] - vertex[owner].at[0]) >> k);
    to.y = std::int8_t((vertex[other].at[1] - vertex[owner].at[1]) >> k);
    to.z = std::int8_t((vertex[other].at[2] - vertex[owner].at[2]) >> k);
    int local = 0;
    while (local < owner_row.vertices && owner_row.vertex[local] != to) ++local;
    assert(local < owner_row.vertices && "every edge is a subdivision edge of its younger end");
    links.edge[e] = {std::uint8_t(owner), std::uint8_t(local)};
  }
  for (int k = 0; k < row.parents; ++k) {
    while (row.vertex[links.parent[k]] != row.parent[k]) ++links.parent[k];
  }
  for (int k = 0; k < row.children; ++k) {
    const Offset to = row.child[k].child;
    links.child[k] = row.cls < 2 ? link_to(near_of(type, to), parity) : link_to_finer(type, to);
  }
  return links;
}

}  // namespace

const LinkTable& link_table() {
  static const std::unique_ptr<const LinkTable> table = [] {
    auto made = std::make_unique<LinkTable>();
    for (unsigned parity = 0; parity < 8; ++parity) {
      for (Slot slot{0}; slot < kSlots; ++slot) (*made)[parity][slot] = links_of(slot, parity);
    }
    return made;
  }();
  return *table;
}

SupercubePlace neighbour_at(int where, int scale, Vertex p) {
  const Offset o = kSteps[std::size_t(where)];
  if (where < kCoarser) return {scale, {p.x + o.x, p.y + o.y, p.z + o.z}};
  if (where < kCorner) return {scale + 1, {(p.x >> 1) + o.x, (p.y >> 1) + o.y, (p.z >> 1) + o.z}};
  if (where >= kFiner) return {scale - 1, {2 * p.x + o.x, 2 * p.y + o.y, 2 * p.z + o.z}};
  const Vertex v{(p.x + o.x) << (scale + 2), (p.y + o.y) << (scale + 2), (p.z + o.z) << (scale + 2)};
  const int of_v = scale_of(v), up = of_v + 2;
  if (of_v == kOriginScale) return {kOriginScale, {}};
  return {of_v, {v.x >> up, v.y >> up, v.z >> up}, kSlotOfType[type_of(v, of_v)]};
}

void SetFinder::move_to(int scale, Vertex position) {
  const Vertex brick{position.x >> 2, position.y >> 2, position.z >> 2};
  if (scale == scale_ && brick == brick_) return;
  scale_ = scale;
  brick_ = brick;
  same_.fill(kUnknown);
  coarser_.fill(kUnknown);
  finer_is_reset_ = false;
}

BrickIndex& SetFinder::brick_at(int where, Vertex at) {
  if (where < kCoarser) return same_[std::size_t(at.x - brick_.x + 1 + 3 * (at.y - brick_.y + 1) + 9 * (at.z - brick_.z + 1))];
  if (where < kCorner) return coarser_[std::size_t(at.x - (brick_.x >> 1) + 2 * (at.y - (brick_.y >> 1)) + 4 * (at.z - (brick_.z >> 1)))];
  if (!finer_is_reset_) finer_.fill(kUnknown);
  finer_is_reset_ = true;
  return finer_[std::size_t(at.x - 2 * brick_.x + 1 + 4 * (at.y - 2 * brick_.y + 1) + 16 * (at.z - 2 * brick_.z + 1))];
}

SetFinder::Found SetFinder::find(int where, const SupercubePlace& place) {
  const Vertex at{place.position.x >> 2, place.position.y >> 2, place.position.z >> 2};
  BrickIndex looked_up = kUnknown;  // bricks around a corner are not kept
  BrickIndex& brick = where >= kCorner && where < kFiner ? looked_up : brick_at(where, at);
  if (brick == kUnknown) brick = set_.find_brick(place.scale, at).value_or(kNone);
  return brick == kNone ? none() : find_in(brick, place.position);
}

}  // namespace intervale
