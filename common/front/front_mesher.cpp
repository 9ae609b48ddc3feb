#include "common/front/front_mesher.h"

#include <bit>
#include <memory>

#include "common/front/front.h"
#include "common/front/shown_splits.h"
#include "common/patch/channel.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// Of each class: the edges at each vertex, a bit each.
constexpr std::array<std::array<std::uint32_t, kMaxVertices>, 3> kEdgesAt = [] {
  std::array<std::array<std::uint32_t, kMaxVertices>, 3> tables{};
  constexpr std::array<int, 3> belts{6, 4, 8};
  for (std::size_t cls = 0; cls < 3; ++cls) {
    for (int e = 0; e < 1 + 3 * belts[cls]; ++e) {
      for (const int end : edge_ends(e, belts[cls])) tables[cls][std::size_t(end)] |= 1u << e;
    }
  }
  return tables;
}();

struct OwnIds {  // numbers points by their ids
  PointId operator[](PointId id) const { return id; }
};

}  // namespace

void FrontMesher::set_values(const MeshChannel& channel, const Ends& ends, std::span<double> values) {
  channel.values_at(ends.centre, values);
  if (ends.at == 0) return;
  std::array<double, kMaxComponents> far{};
  channel.values_at(ends.vertex, std::span(far).first(values.size()));
  const double share = double(ends.at) / kSteps;
  for (std::size_t c = 0; c < values.size(); ++c) values[c] = values[c] * (1 - share) + far[c] * share;
}

FrontMesher::Corners FrontMesher::corners_of(const TetShape& s) {
  Corners corners;
  for (int c = 0; c < kPatchCorners; ++c) corners[c] = c < 4 ? s.vertex[c] : std::uint8_t(kCutsFrom + 2 * s.edge[(c - 4) / 2] + (c & 1));
  return corners;
}

const FrontMesher::HalfCorners& FrontMesher::half_corners() {
  static const std::unique_ptr<const HalfCorners> table = [] {
    auto made = std::make_unique<HalfCorners>();
    for (Slot slot{0}; slot < kSlots; ++slot) {
      const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
      for (int t = 0; t < row.tets; ++t) {
        for (int end = 0; end < 2; ++end) (*made)[slot][t][end] = corners_of(row.half_shape[t][end]);
      }
    }
    return made;
  }();
  return *table;
}

// On an axis that clamps, at or beyond the last sample. Only edges with such an end can share their place with another
// edge.
bool FrontMesher::is_on_border(Vertex v) const {
  const std::int32_t n = 1 << state_.domain.levels();
  const Vertex last = state_.domain.last();
  return (last.x < n && v.x >= last.x) || (last.y < n && v.y >= last.y) || (last.z < n && v.z >= last.z);
}

bool FrontMesher::is_at_border(std::size_t number) const {
  const std::int32_t reach = 4 << block(number).scale;
  const Vertex p = block(number).position;
  return is_on_border({(p.x + 1) * reach, (p.y + 1) * reach, (p.z + 1) * reach});
}

void FrontMesher::append_points(std::size_t number, std::vector<Point>& points, std::span<const std::uint8_t> wanted, std::vector<Ends>* ends) const {
  // The domain's corner (0, 0, 0), the oldest vertex, owns no edge.
  if (const FrontState::Split origin = state_.origin.split_at(Slot()); number == 0 && origin.side() == Side::inside) {
    points.push_back({origin.centre(), {}, Surface::inside, false});
    if (ends != nullptr) ends->emplace_back();
  }
  const FrontState::Block& block = state_.blocks[number];
  FrontCursor cursor(state_);
  cursor.move_to(block.scale, block.position);
  for (const Slot slot : set_bits<Slot>(block.shown & block.placed.slots())) {
    append_cuts(cursor, Diamond(centre_of(block.scale, block.position, slot), block.scale, kTypeOfSlot[slot]), points, wanted, ends);
  }
}

// The points of one split in the cursor's supercube.
void FrontMesher::append_cuts(FrontCursor& cursor, const Diamond& d, std::vector<Point>& points, std::span<const std::uint8_t> wanted,
                              std::vector<Ends>* ends) const {
  const FrontValues& values = state_.values;
  const Slot slot = kSlotOfType[d.type];
  const FrontState::Split split = cursor.here().placed[slot];
  const Links& links = cursor.links(slot);
  const bool may_clamp = !cursor.is_interior();
  const bool on_border = may_clamp && is_on_border(d.centre);
  const Vertex c = may_clamp ? state_.domain.clamp(d.centre) : d.centre;
  const double centre = values.format.value(cursor.here().key[slot]);
  const std::array<double, 3> kappa{0, values.range.alpha, values.range.beta};
  PointId id = split.first;
  for (std::uint32_t bits = split.cut_bits(); bits != 0;) {
    const int v = std::countr_zero(bits) / 2;
    const PointId first = id;
    const unsigned surfaces = split.cuts_to(v);
    id += PointId(std::popcount(surfaces));
    bits &= ~(3u << (2 * v));
    if (!wanted.empty() && wanted[first] == 0 && wanted[id - 1] == 0) continue;
    const FrontCursor::Neighbour vertex = cursor.at(links.vertex[v]);
    const double value = values.format.value(vertex.block.key[vertex.slot]);
    const Vertex end = d.vertex(v), e = may_clamp ? state_.domain.clamp(end) : end;
    const bool ends_on_border = on_border || (may_clamp && is_on_border(end));
    const auto add = [&](PointId point, std::uint8_t q, Surface surface) {
      const std::int32_t t = 2 * q + 1;
      const Position at{c.x * kSteps + (e.x - c.x) * t, c.y * kSteps + (e.y - c.y) * t, c.z * kSteps + (e.z - c.z) * t};
      points.push_back({point, at, surface, ends_on_border});
      if (ends != nullptr) ends->push_back({d.centre, end, t});
    };
    if (surfaces == 3) {
      const Cuts cuts = cuts_between(centre, value, values.range);
      add(first, cuts.q[0], Surface::alpha);
      add(first + 1, cuts.q[1], Surface::beta);
    } else {
      add(first, cut_between(centre, value, kappa[surfaces]), surfaces == 1 ? Surface::alpha : Surface::beta);
    }
  }
  if (split.side() != Side::inside) return;
  points.push_back({id, {c.x * kSteps, c.y * kSteps, c.z * kSteps}, Surface::inside, on_border});
  if (ends != nullptr) ends->push_back({d.centre, d.centre, 0});
}

void FrontMesher::append_runs(std::size_t number, std::vector<Run>& runs) const {
  if (const FrontState::Split origin = state_.origin.split_at(Slot()); number == 0) runs.push_back({origin.first, origin.points()});
  for (const Slot slot : set_bits<Slot>(block(number).shown & block(number).placed.slots())) {
    const FrontState::Split split = block(number).placed[slot];
    runs.push_back({split.first, split.points()});
  }
}

void FrontMesher::append_removed_runs(std::size_t number, std::vector<Run>& runs) const {
  if (state_.is_root_block(block(number))) return;
  FrontCursor cursor(state_);
  cursor.move_to(block(number).scale, block(number).position);
  for (const Slot slot : set_bits<Slot>(block(number).shown)) {
    const Links& links = cursor.links(slot);
    const Links::Edge spine = links.edge[0];
    const FrontState::Split owner = cursor.at(links.vertex[spine.owner]).split();
    runs.push_back({owner.cut(2 * spine.other), std::uint32_t(owner.cut_count(spine.other))});
  }
}

// Sets the patch of one tetrahedron; returns its end. Inline: it is the innermost loop of making a mesh.
inline FrontMesher::Tet* FrontMesher::place_patch(Tet* to, const TetShape& shape, const Corners& corners, std::uint32_t sides,
                                                  const PointsAround& points) const {
  const auto patch = cases_.tets(shape.order, shape_sides(shape, sides));
  const int second = shape.flip ? 3 : 2, third = shape.flip ? 2 : 3;
  for (const auto& tet : patch) {
    *to++ = {points[corners[tet[0]]], points[corners[tet[1]]], points[corners[tet[second]]], points[corners[tet[third]]]};
  }
  return to;
}

inline void FrontMesher::append_patch_faces(const TetShape& shape, const Corners& corners, std::uint32_t sides, const PointsAround& points,
                                            std::vector<Face>& faces) const {
  const int second = shape.flip ? 2 : 1, third = shape.flip ? 1 : 2;
  for (const auto& face : cases_.faces(shape.order, shape_sides(shape, sides))) {
    const Surface surface = face[0] % 2 == 0 ? Surface::alpha : Surface::beta;
    faces.push_back({{points[corners[face[0]]], points[corners[face[second]]], points[corners[face[third]]]}, surface});
  }
}

// Lengthens tets by as many as the patches of one diamond may have; returns the first.
FrontMesher::Tet* FrontMesher::make_room(Tets& tets) const {
  const std::size_t before = tets.size();
  tets.resize(before + std::size_t(2 * kMaxTets) * cases_.most());
  return tets.data() + before;
}

// A bit for each child whose split is not shown.
unsigned FrontMesher::children_not_shown(FrontCursor& cursor, Slot slot) {
  const std::span<const Link> children = cursor.children(slot);
  if (cursor.scale() == 0 && class_of_slot(slot) == 2) return (1u << children.size()) - 1;  // leaves, which are never split
  unsigned some = 0, bit = 1;
  for (const Link link : children) {
    if (!cursor.at(link).is_shown()) some |= bit;
    bit <<= 1;
  }
  return some;
}

// Calls visit(cursor, children): for the splits of these slots that leave tetrahedra to some children, with those as bits.
template <class Visit>
void FrontMesher::visit_splits(std::size_t number, std::uint64_t slots, const Visit& visit) const {
  if (slots == 0) return;
  FrontCursor cursor(state_);
  cursor.move_to(block(number).scale, block(number).position);
  for (const Slot slot : set_bits<Slot>(slots)) {
    const unsigned unsplit = children_not_shown(cursor, slot);
    if (unsplit == 0) continue;
    cursor.gather_own(slot);
    visit(cursor, unsplit);
  }
}

// Calls visit(cursor, shape, t) for each tetrahedron of the root, if that is not split.
template <class Visit>
void FrontMesher::visit_root(const Visit& visit) const {
  const Diamond root(state_.domain.root());
  FrontCursor cursor(state_);
  cursor.move_to(root);
  if (!cursor.gather_sides(kSlotOfType[root.type]) || cursor.is_shown()) return;
  for (const int t : set_bits(cursor.parts().tets)) visit(cursor, tet_shape(state_.domain, root, cursor.parts(), t), t);
}

template <class Numbers>
void FrontMesher::gather_points(FrontCursor& cursor, const Numbers& numbers, PointsAround& points) {
  const DiamondContext& context = cursor.context();
  const Links& links = cursor.links();
  const auto& edges_at = kEdgesAt[context.row->cls];
  std::uint32_t alpha = 0, beta = 0;  // the edges that each surface cuts: exactly one end is below, or above
  for (const int v : set_bits(context.vertices)) {
    const Side side = context.side(v);
    if (side == Side::inside) {
      points[v] = numbers[cursor.at(links.vertex[v]).split().centre()];
    } else {
      (side == Side::below ? alpha : beta) ^= edges_at[v];
    }
  }
  for (const int e : set_bits((alpha | beta) & cursor.parts().edges)) {
    const Links::Edge edge = links.edge[e];
    const FrontState::Split owner = cursor.at(links.vertex[edge.owner]).split();
    const unsigned surfaces = owner.cuts_to(edge.other);
    PointId id = owner.cut(2 * edge.other);
    if (surfaces & 1) points[kCutsFrom + 2 * e] = numbers[id++];
    if (surfaces & 2) points[kCutsFrom + 2 * e + 1] = numbers[id];
  }
}

// Of the split diamond that the cursor found last, with the points that its split brought.
template <class Numbers>
void FrontMesher::gather_points_with_centre(FrontCursor& cursor, const Numbers& numbers, PointsAround& points) {
  gather_points(cursor, numbers, points);
  const FrontState::Split split = cursor.here().split_at(cursor.slot());
  PointId id = split.first;
  for (const int bit : set_bits(split.cut_bits())) points[kCutsFrom + 2 * kSubdivision + bit] = numbers[id++];
  if (split.side() == Side::inside) points[kCentre] = numbers[id];
}

// Of the split diamond that the cursor found last, the halves that it left to some of its children, a bit each. Calls
// visit(half, shape, corners, sides, has_patch).
template <class Visit>
void FrontMesher::visit_halves(FrontCursor& cursor, unsigned children, const Visit& visit) const {
  const FrontState::Split split = cursor.here().split_at(cursor.slot());
  const Diamond d = cursor.diamond();
  const DiamondParts& parts = cursor.parts();
  const std::uint32_t sides = cursor.context().sides | std::uint32_t(split.side()) << (2 * kCentre);
  const auto& corners = half_corners_[cursor.slot()];
  const Ring ring(sides, d.row->belt);
  for (const int k : set_bits(children)) {
    for (const Duet::Half& half : d.row->child[k].half) {
      if (!(parts.tets >> half.tet & 1)) continue;
      const bool has_patch = cases_.count(ring.half(half.tet, half.end)) != 0;
      if (!parts.straddles) {
        visit(half, d.row->half_shape[half.tet][half.end], corners[half.tet][half.end], sides, has_patch);
      } else if (half_exists(state_.domain, d, half.tet, half.end)) {
        const TetShape shape = half_shape(state_.domain, d, parts, half.tet, half.end);
        visit(half, shape, corners_of(shape), sides, has_patch);
      }
    }
  }
}

// Those of the children that get a half with vertices on different sides, a bit each.
unsigned FrontMesher::children_with_mixed_halves(FrontCursor& cursor, unsigned children) {
  const FrontState::Split split = cursor.here().split_at(cursor.slot());
  const DiamondType& row = *cursor.context().row;
  const Ring ring(cursor.context().sides | std::uint32_t(split.side()) << (2 * kCentre), row.belt);
  unsigned mixed = 0;
  for (const int k : set_bits(children)) {
    for (const Duet::Half& half : row.child[k].half) {
      const unsigned sides = ring.half(half.tet, half.end);
      mixed |= unsigned(sides != (sides & 3) * 0x55) << k;  // of a half that does not exist, perhaps needlessly
    }
  }
  return mixed;
}

bool FrontMesher::can_change(FrontCursor& cursor, Vertex centre) {
  const Diamond d(centre);
  const int up = d.scale + 2;
  const Vertex position{centre.x >> up, centre.y >> up, centre.z >> up};
  if (cursor.scale() != d.scale || cursor.position() != position) cursor.move_to(d.scale, position);
  return cursor.gather_sides(kSlotOfType[d.type]) && !cursor.is_noop() && cursor.context().is_mixed();
}

template <class Numbers>
void FrontMesher::append_tets_by(std::size_t number, Tets& tets, const Numbers& numbers) const {
  PointsAround points;
  const auto end_at = [&tets](const Tet* to) { tets.resize(std::size_t(to - tets.data())); };
  if (state_.is_root_block(block(number))) {
    visit_root([&](FrontCursor& cursor, const TetShape& shape, int) {
      gather_points(cursor, numbers, points);
      end_at(place_patch(make_room(tets), shape, corners_of(shape), cursor.context().sides, points));
    });
    return;
  }
  visit_splits(number, block(number).shown, [&](FrontCursor& cursor, unsigned children) {
    const FrontState::Split split = cursor.here().split_at(cursor.slot());
    if (split.cut_bits() == 0 && split.side() != Side::inside) return;  // all on one side, and not inside
    gather_points_with_centre(cursor, numbers, points);
    Tet* to = make_room(tets);
    visit_halves(cursor, children, [&](Duet::Half, const TetShape& shape, const Corners& corners, std::uint32_t sides, bool has_patch) {
      if (has_patch) to = place_patch(to, shape, corners, sides, points);
    });
    end_at(to);
  });
}

void FrontMesher::append_tets(std::size_t number, Tets& tets, std::span<const std::uint32_t> numbers) const {
  if (numbers.empty()) {
    append_tets_by(number, tets, OwnIds());
  } else {
    append_tets_by(number, tets, numbers);
  }
}

void FrontMesher::append_faces(std::size_t number, std::vector<Face>& faces) const {
  PointsAround points;
  if (state_.is_root_block(block(number))) {
    visit_root([&](FrontCursor& cursor, const TetShape& shape, int) {
      gather_points(cursor, OwnIds(), points);
      append_patch_faces(shape, corners_of(shape), cursor.context().sides, points, faces);
    });
    return;
  }
  // What does not count lies on one side. Of what does, only halves with vertices on different sides have faces.
  visit_splits(number, block(number).shown & block(number).counts, [&](FrontCursor& cursor, unsigned children) {
    const unsigned mixed = children_with_mixed_halves(cursor, children);
    if (mixed == 0) return;
    gather_points_with_centre(cursor, OwnIds(), points);
    visit_halves(cursor, mixed, [&](Duet::Half, const TetShape& shape, const Corners& corners, std::uint32_t sides, bool has_patch) {
      if (has_patch) append_patch_faces(shape, corners, sides, points, faces);
    });
  });
}

void FrontMesher::append_halves(std::size_t number, Tets& tets, std::vector<Half>& halves) const {
  PointsAround points;
  const auto add = [&](const TetShape& shape, const Corners& corners, std::uint32_t sides, const std::array<Vertex, 4>& of_half) {
    const Tet* const end = place_patch(make_room(tets), shape, corners, sides, points);
    tets.resize(std::size_t(end - tets.data()));
    halves.push_back({of_half, tets.size()});
  };
  if (state_.is_root_block(block(number))) {
    visit_root([&](FrontCursor& cursor, const TetShape& shape, int t) {
      if (!cursor.context().is_mixed()) return;
      gather_points(cursor, OwnIds(), points);
      const Diamond root = cursor.diamond();
      add(shape, corners_of(shape), cursor.context().sides, state_.domain.positions(root, root.row->tet(t)));
    });
    return;
  }
  FrontCursor at_child(state_);
  at_child.move_to(block(number).scale, block(number).position);
  visit_splits(number, block(number).shown, [&](FrontCursor& cursor, unsigned children) {
    const Diamond d = cursor.diamond();
    if (!d.has_children()) return;
    unsigned changing = 0;
    for (const int k : set_bits(children)) changing |= unsigned(can_change(at_child, d.child(k))) << k;
    if (changing == 0) return;
    gather_points_with_centre(cursor, OwnIds(), points);
    visit_halves(cursor, changing, [&](Duet::Half half, const TetShape& shape, const Corners& corners, std::uint32_t sides, bool) {
      auto local = d.row->tet(half.tet);
      local[1 - half.end] = kCentre;
      add(shape, corners, sides, state_.domain.positions(d, local));
    });
  });
}

}  // namespace intervale
