// The mesh of a front, supercube by supercube: the halves that split diamonds leave to children that are not split, each cut into its patch.
//
// Whoever draws a mesh that changes goes by this: what a supercube's splits leave stays as it is until splits in it, or children of them, are shown
// or hidden. Points have names, which stay too, until the front forgets (Front::renamed).
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "common/front/front.h"
#include "common/patch/tet_cases.h"

namespace intervale {

class FrontPatches {
 public:
  explicit FrontPatches(const Front& front) : front_(front) {}  // which must outlive it, and may change

  using Tet = std::array<std::uint32_t, 4>;      // points by name, positively oriented
  using Position = std::array<std::int32_t, 3>;  // in 1 / kSteps of a sample: every cut of every edge is whole there
  static constexpr std::int32_t kSteps = 512;

  // Supercubes in which something was split, by number: 0, 1, ... in order of their coming. One of them, of scale Domain::levels(), has the domain's
  // corners; what it leaves is the root's patch.
  [[nodiscard]] std::size_t supercubes() const { return front_.blocks_.size(); }
  [[nodiscard]] int scale(std::size_t number) const { return front_.blocks_[number].scale; }
  [[nodiscard]] Vertex position(std::size_t number) const { return front_.blocks_[number].position; }
  [[nodiscard]] std::uint64_t shown(std::size_t number) const { return front_.blocks_[number].shown; }  // slots whose splits are shown
  [[nodiscard]] std::optional<std::size_t> find(int scale, Vertex position) const {
    const std::uint32_t number = front_.find_number(scale, position);
    if (number == Front::kNone) return {};
    return number;
  }
  [[nodiscard]] const Domain& domain() const { return front_.domain_; }
  [[nodiscard]] const Grid& grid() const { return front_.grid_; }
  [[nodiscard]] std::size_t names() const { return front_.q_.size(); }  // all names of points are below
  // Whether diamonds of this supercube reach the far faces of the box, where clamping moves vertices.
  [[nodiscard]] bool is_at_border(std::size_t number) const { return is_at_border(front_.blocks_[number]); }

  // Calls visit(name, position, surface, on the border) for the points that a supercube's splits brought; of the first one, also for the domain's
  // corners.
  template <class Visit>
  void for_each_point(std::size_t number, const Visit& visit) const {
    if (number == 0) for_corner(visit);
    for_each_point(front_.blocks_[number], visit);
  }

  // Calls visit(first name, count) for runs of the same points.
  template <class Visit>
  void for_each_run(std::size_t number, const Visit& visit) const {
    if (number == 0 && front_.corner_.of[0].side() == Side::inside) visit(front_.corner_.of[0].centre(), 1u);
    const Front::Block& block = front_.blocks_[number];
    for (std::uint64_t left = block.shown; left != 0; left &= left - 1) {
      const Front::Split& split = block.of[std::countr_zero(left)];
      visit(split.first, split.centre() - split.first + (split.side() == Side::inside));
    }
  }

  // Calls visit(first name, count) for runs of points that a supercube's splits took away: those on the edges that they split.
  template <class Visit>
  void for_each_lost_run(std::size_t number, const Visit& visit) const {
    const Front::Block& block = front_.blocks_[number];
    if (block.scale == front_.domain_.levels()) return;
    Front::Cursor cursor(front_);
    cursor.move_to(block.scale, block.position);
    for (std::uint64_t left = block.shown; left != 0; left &= left - 1) {
      const Links& links = (*cursor.links_)[std::countr_zero(left)];
      const Links::Edge spine = links.edge[0];
      const auto found = cursor.at(links.vertex[spine.owner]);
      const Front::Split& owner = found.block->of[found.slot];
      const int bit = 2 * spine.other;
      visit(owner.cut(bit), std::uint32_t(std::popcount(owner.bits >> bit & 3)));
    }
  }

  // Half of a tetrahedron that a split left, cut into its patch: the tetrahedra that follow `first`.
  struct Half {
    std::array<Vertex, 4> corners;  // in samples
    bool can_change = false;        // the diamond that it is of can be split, and has vertices on different sides
  };
  struct Unheard {  // for whoever does not want to be told of halves
    void operator()(const Half&, std::size_t) const {}
  };

  struct Themselves {  // names, as names[name]
    std::uint32_t operator[](std::uint32_t name) const { return name; }
  };

  // Appends the tetrahedra that a supercube's splits left, points by names[name]. on_half(half, first) is called before each half's tetrahedra are
  // appended from out[first] on, for halves without any too.
  template <class Names, class OnHalf = Unheard>
  void emit(std::size_t number, const Names& names, std::vector<Tet>& out, const OnHalf& on_half = {}) const {
    emit_block(front_.blocks_[number], names, out, on_half);
  }

 private:
  // The mesh points around one diamond: those of its vertices, then each edge's cut by alpha and by beta.
  static constexpr int kCutsFrom = kMaxVertices + 1;
  using PointsAround = std::array<std::uint32_t, kCutsFrom + 2 * (kMaxEdges + kMaxVertices)>;
  // Where among the points around a diamond the corners of a tetrahedron's patch are.
  using Corners = std::array<std::uint8_t, kPatchCorners>;
  // Of the halves of all types' tetrahedra.
  using HalfCorners = std::array<std::array<std::array<Corners, 2>, kMaxTets>, kSlots>;
  static Corners corners_of(const TetShape& s);
  static const HalfCorners& half_corners();

  [[nodiscard]] bool is_at_border(const Front::Block& block) const {
    const std::int32_t reach = 4 << block.scale;
    const Vertex p = block.position;
    return front_.is_border({(p.x + 1) * reach, (p.y + 1) * reach, (p.z + 1) * reach});
  }

  template <class Visit>
  void for_corner(const Visit& visit) const {  // (0, 0, 0), the oldest vertex: no edge is its own
    if (front_.corner_.of[0].side() == Side::inside) visit(front_.corner_.of[0].centre(), Position{}, Surface::inside, false);
  }
  template <class Visit>
  void for_each_point(const Front::Block& block, const Visit& visit) const {
    const bool at_border = is_at_border(block);
    for (std::uint64_t left = block.shown; left != 0; left &= left - 1) {
      const int slot = std::countr_zero(left);
      for_each_point(Diamond(centre_of(block.scale, block.position, slot), block.scale, kTypeOfSlot[slot]), block.of[slot], at_border, visit);
    }
  }
  template <class Visit>
  void for_each_point(const Diamond& d, const Front::Split& split, bool at_border, const Visit& visit) const {
    const Vertex c = at_border ? front_.domain_.clamp(d.centre) : d.centre;
    const bool border = at_border && front_.is_border(d.centre);
    std::uint32_t point = split.first;
    for (std::uint32_t left = split.bits & Front::kCutBits; left != 0; left &= left - 1, ++point) {
      const int bit = std::countr_zero(left);
      const Vertex end = d.vertex(bit / 2), v = at_border ? front_.domain_.clamp(end) : end;
      const std::int32_t t = 2 * front_.q_[point] + 1;
      visit(point, Position{c.x * kSteps + (v.x - c.x) * t, c.y * kSteps + (v.y - c.y) * t, c.z * kSteps + (v.z - c.z) * t},
            (bit & 1) == 0 ? Surface::alpha : Surface::beta, border || (at_border && front_.is_border(end)));
    }
    if (split.side() == Side::inside) visit(point, Position{c.x * kSteps, c.y * kSteps, c.z * kSteps}, Surface::inside, border);
  }

  template <class Names, class OnHalf>
  void emit_block(const Front::Block& block, const Names& names, std::vector<Tet>& out, const OnHalf& on_half) const {
    if (block.scale == front_.domain_.levels()) {
      emit_root(names, out, on_half);
      return;
    }
    if (block.shown == 0) return;
    Front::Cursor cursor(front_);
    cursor.move_to(block.scale, block.position);
    for (std::uint64_t left = block.shown; left != 0; left &= left - 1) {
      const int slot = std::countr_zero(left);
      const unsigned children = unsplit_children(cursor, slot);
      if (children != 0 && cursor.gather(slot)) emit_halves(cursor, block.of[slot], children, names, out, on_half);
    }
  }

  template <class Names, class OnHalf>
  void emit_root(const Names& names, std::vector<Tet>& out, const OnHalf& on_half) const {
    const Diamond root(front_.domain_.root());
    Front::Cursor cursor(front_);
    cursor.move_to(root.scale, {});
    if (!cursor.gather(kSlotOfType[root.type]) || cursor.is_shown()) return;
    PointsAround points;
    gather_points(cursor, names, points);
    for (int t = 0; t < root.row->tets; ++t) {
      if (!(cursor.existing_.tets >> t & 1)) continue;
      const TetShape shape = front_.shape(root, cursor.existing_, t);
      on_half(Half{front_.domain_.positions(root, root.row->tet(t)), cursor.context_.is_mixed()}, out.size());
      emit(shape, corners_of(shape), cursor.context_.sides, points, out);
    }
  }

  // A bit for each child whose split is not shown.
  [[nodiscard]] static unsigned unsplit_children(Front::Cursor& cursor, int slot) {
    const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
    const Links& links = (*cursor.links_)[slot];
    unsigned unsplit = 0;
    for (int k = 0; k < row.children; ++k) {
      const auto found = cursor.at(links.child[k]);
      unsplit |= unsigned(~found.block->shown >> found.slot & 1) << k;
    }
    return unsplit;
  }

  template <class Names>
  static void gather_points(const Front::Cursor& cursor, const Names& names, PointsAround& points) {
    const DiamondType& row = *cursor.context_.row;
    const Links& links = (*cursor.links_)[cursor.slot_];
    for (int v = 0; v < row.vertices; ++v) {
      if (cursor.context_.has(v) && cursor.context_.side(v) == Side::inside) points[v] = names[cursor.split_[v].centre()];
    }
    if (!cursor.context_.is_mixed()) return;
    for (int e = 0; e < row.edges; ++e) {
      if (!(cursor.existing_.edges >> e & 1)) continue;
      const Links::Edge edge = links.edge[e];
      const Front::Split& owner = cursor.split_[edge.owner];
      const unsigned two = owner.bits >> (2 * edge.other) & 3;
      if (two == 0) continue;
      std::uint32_t point = owner.cut(2 * edge.other);
      if (two & 1) points[kCutsFrom + 2 * e] = names[point++];
      if (two & 2) points[kCutsFrom + 2 * e + 1] = names[point];
    }
  }

  template <class Names, class OnHalf>
  void emit_halves(const Front::Cursor& cursor, const Front::Split& split, unsigned children, const Names& names, std::vector<Tet>& out,
                   const OnHalf& on_half) const {
    constexpr bool kTells = !std::is_same_v<OnHalf, Unheard>;
    const Diamond& d = *cursor.diamond_;
    const DiamondType& row = *cursor.context_.row;
    const std::uint32_t sides = cursor.context_.sides | std::uint32_t(split.side()) << (2 * kCentre);
    // All on one side, and not inside?
    if (!kTells && (split.bits & Front::kCutBits) == 0 && split.side() != Side::inside) return;
    PointsAround points;
    gather_points(cursor, names, points);
    std::uint32_t point = split.first;
    for (std::uint32_t left = split.bits & Front::kCutBits; left != 0; left &= left - 1) {
      points[kCutsFrom + 2 * kSubdivision + std::countr_zero(left)] = names[point++];
    }
    if (split.side() == Side::inside) points[kCentre] = names[point];
    const auto& corners = half_corners_[cursor.slot_];
    const Ring ring(sides, row.belt);
    for (; children != 0; children &= children - 1) {
      const int k = std::countr_zero(children);
      [[maybe_unused]] const bool can_change = kTells && d.has_children() && can_change_child(d.child(k));
      for (const Duet::Half& half : row.child[k].half) {
        if (!(cursor.existing_.tets >> half.tet & 1)) continue;
        if constexpr (!kTells) {
          if (cases_.count(ring.half(half.tet, half.end)) == 0) continue;
        }
        if (cursor.existing_.straddles && !front_.half_exists(d, half.tet, half.end)) continue;
        if constexpr (kTells) {
          auto local = row.tet(half.tet);
          local[1 - half.end] = kCentre;
          on_half(Half{front_.domain_.positions(d, local), can_change}, out.size());
          if (cases_.count(ring.half(half.tet, half.end)) == 0) continue;
        }
        if (!cursor.existing_.straddles) {
          emit(row.half_shape[half.tet][half.end], corners[half.tet][half.end], sides, points, out);
        } else {
          const TetShape shape = front_.half_shape(d, cursor.existing_, half.tet, half.end);
          emit(shape, corners_of(shape), sides, points, out);
        }
      }
    }
  }

  [[nodiscard]] bool can_change_child(Vertex centre) const;

  // The patch of one tetrahedron.
  void emit(const TetShape& shape, const Corners& corners, std::uint32_t sides, const PointsAround& points, std::vector<Tet>& out) const {
    const auto tets = cases_.tets(shape.order, shape_sides(shape, sides));
    const int second = shape.flip ? 3 : 2, third = shape.flip ? 2 : 3;
    const std::size_t from = out.size();
    out.resize(from + tets.size());
    Tet* to = out.data() + from;
    for (const auto& tet : tets)
      *to++ = {points[corners[tet[0]]], points[corners[tet[1]]], points[corners[tet[second]]], points[corners[tet[third]]]};
  }

  const Front& front_;
  const TetCases& cases_ = tet_cases();
  const HalfCorners& half_corners_ = half_corners();
};

}  // namespace intervale
