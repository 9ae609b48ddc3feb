// The mesh of a front: the halves that split diamonds leave to children that are not split, each cut into its patch.
//
// Which points it has is known before its tetrahedra: a cut is one as long as its edge is, which is until the diamond is split whose spine that is;
// and a centre inside the range stays one. Only on the far faces of a box that clamps (domain.h), where edges can be one edge or none, do the
// tetrahedra themselves have to say.
#include <algorithm>
#include <cassert>
#include <memory>

#include "common/front.h"
#include "common/tet_cases.h"

namespace intervale {
namespace {

// The mesh points around one diamond: those of its vertices, then each edge's cut by alpha and by beta.
constexpr int kCutsFrom = kMaxVertices + 1;
using PointsAround = std::array<std::uint32_t, kCutsFrom + 2 * (kMaxEdges + kMaxVertices)>;

// Where among the points around a diamond the corners of a tetrahedron's patch are.
using Corners = std::array<std::uint8_t, kPatchCorners>;

Corners corners_of(const TetShape& s) {
  Corners corners;
  for (int c = 0; c < kPatchCorners; ++c) corners[c] = c < 4 ? s.vertex[c] : std::uint8_t(kCutsFrom + 2 * s.edge[(c - 4) / 2] + (c & 1));
  return corners;
}

// Of the halves of all types' tetrahedra.
using HalfCorners = std::array<std::array<std::array<Corners, 2>, kMaxTets>, kSlots>;

const HalfCorners& half_corners() {
  static const std::unique_ptr<const HalfCorners> table = [] {
    auto made = std::make_unique<HalfCorners>();
    for (int slot = 0; slot < kSlots; ++slot) {
      const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
      for (int t = 0; t < row.tets; ++t) {
        for (int end = 0; end < 2; ++end) (*made)[slot][t][end] = corners_of(row.half_shape[t][end]);
      }
    }
    return made;
  }();
  return *table;
}

}  // namespace

class FrontMesh {
 public:
  FrontMesh(const Front& front, const ParallelFor& parallel)
      : front_(front), parallel_(parallel), pieces_((front.blocks_.size() + kPiece - 1) / kPiece), used_(front.q_.size()), number_(front.q_.size()) {}

  Mesh make() {
    parallel_(pieces_, [this](std::size_t piece) { use_edges(piece); });
    parallel_(pieces_, [this](std::size_t piece) { drop_spines(piece); });
    if (!front_.domain_.is_whole()) use_border();
    std::uint32_t points = 0;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      number_[i] = points;
      points += used_[i];
    }
    for (const auto& [point, same] : same_) number_[point] = number_[same];

    Mesh mesh;
    mesh.points.resize(points);
    mesh.surface.resize(points);
    mesh.tets.resize(front_.tet_count());
    parallel_(pieces_, [&](std::size_t piece) {
      for_each_point(piece, [&](std::uint32_t point, const Position& p, Surface surface, bool) {
        if (!used_[point]) return;
        const std::uint32_t n = number_[point];
        for (int i = 0; i < 3; ++i) mesh.points[n][i] = front_.grid_.origin[i] + front_.grid_.spacing[i] * p[i] * (1.0 / kSteps);
        mesh.surface[n] = surface;
      });
    });
    // A few pieces at a time: what they make goes to its place while it is still in a cache.
    std::array<std::vector<Tet>, kPiecesAtOnce> tets;
    std::array<std::size_t, kPiecesAtOnce + 1> place{};
    for (std::size_t first = 0; first < pieces_; first += kPiecesAtOnce) {
      const std::size_t some = std::min(pieces_ - first, kPiecesAtOnce);
      parallel_(some, [&](std::size_t i) {
        tets[i].clear();
        emit_piece(first + i, number_, tets[i]);
      });
      for (std::size_t i = 0; i < some; ++i) place[i + 1] = place[i] + tets[i].size();
      assert(place[some] <= mesh.tets.size() && "splits and merges kept count");
      parallel_(some, [&](std::size_t i) { std::copy(tets[i].begin(), tets[i].end(), mesh.tets.begin() + std::ptrdiff_t(place[i])); });
      place[0] = place[some];
    }
    return mesh;
  }

 private:
  using Tet = std::array<std::uint32_t, 4>;
  using Position = std::array<std::int32_t, 3>;  // in 1 / kSteps of a sample: every cut of every edge is whole there
  static constexpr std::int32_t kSteps = 512;
  static constexpr std::size_t kPiece = 32;  // supercubes
  static constexpr std::size_t kPiecesAtOnce = 64;

  // Calls visit(block) for the supercubes of a piece.
  template <class Visit>
  void for_each_block(std::size_t piece, const Visit& visit) const {
    const std::size_t end = std::min(front_.blocks_.size(), (piece + 1) * kPiece);
    for (std::size_t b = piece * kPiece; b < end; ++b) visit(front_.blocks_[b]);
  }
  // Whether diamonds of this supercube reach the border.
  [[nodiscard]] bool is_at_border(const Front::Block& block) const {
    const std::int32_t reach = 4 << block.scale;
    const Vertex p = block.position;
    return front_.is_border({(p.x + 1) * reach, (p.y + 1) * reach, (p.z + 1) * reach});
  }
  // Calls visit(point, position, surface, on the border) for the points that splits brought, in a piece or in a supercube. The domain's corners
  // count as split.
  template <class Visit>
  void for_each_point(std::size_t piece, const Visit& visit) const {
    if (piece == 0) for_corner(visit);
    for_each_block(piece, [&](const Front::Block& block) { for_each_point(block, visit); });
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

  // All points that splits brought, but for those on the border.
  void use_edges(std::size_t piece) {
    const auto use = [this](std::uint32_t point, const Position&, Surface, bool border) { used_[point] = !border; };
    if (piece == 0) for_corner(use);
    for_each_block(piece, [&](const Front::Block& block) {
      if (is_at_border(block)) return for_each_point(block, use);
      for (std::uint64_t left = block.shown; left != 0; left &= left - 1) {
        const Front::Split& split = block.of[std::countr_zero(left)];
        std::fill(used_.begin() + split.first, used_.begin() + split.centre() + (split.side() == Side::inside), std::uint8_t(1));
      }
    });
  }

  // Less those on edges that were split.
  void drop_spines(std::size_t piece) {
    Front::Cursor cursor(front_);
    for_each_block(piece, [&](const Front::Block& block) {
      if (block.scale == front_.domain_.levels()) return;
      cursor.move_to(block.scale, block.position);
      for (std::uint64_t left = block.shown; left != 0; left &= left - 1) {
        const Links& links = (*cursor.links_)[std::countr_zero(left)];
        const Links::Edge spine = links.edge[0];
        const auto found = cursor.at(links.vertex[spine.owner]);
        const Front::Split& owner = found.block->of[found.slot];
        const int bit = 2 * spine.other;
        for (std::uint32_t n = 0; n < std::uint32_t(std::popcount(owner.bits >> bit & 3)); ++n) used_[owner.cut(bit) + n] = 0;
      }
    });
  }

  // Points of the border: those that tetrahedra use, and of those at one place the first for all.
  void use_border() {
    std::vector<std::uint32_t> itself(used_.size());
    for (std::size_t i = 0; i < itself.size(); ++i) itself[i] = std::uint32_t(i);
    std::vector<Tet> tets;
    for (std::size_t piece = 0; piece < pieces_; ++piece) {
      Front::Cursor cursor(front_);
      for_each_block(piece, [&](const Front::Block& block) {
        if (!is_at_border(block)) return;
        tets.clear();
        emit_block(cursor, block, itself, tets);
        for (const Tet& tet : tets) {
          for (std::uint32_t point : tet) used_[point] = 1;
        }
      });
    }
    struct Key {
      Position position;
      Surface surface;
      bool operator==(const Key&) const = default;
    };
    struct Hash {
      std::size_t operator()(const Key& k) const {
        std::uint64_t h = std::uint64_t(k.surface);
        for (const std::int32_t c : k.position) h = (h ^ std::uint32_t(c)) * 0x9e3779b97f4a7c15u;
        return std::size_t(h ^ h >> 32);
      }
    };
    boost::unordered_flat_map<Key, std::uint32_t, Hash> there;
    const auto unite = [&](std::uint32_t point, const Position& p, Surface surface, bool border) {
      if (!border || !used_[point]) return;
      const auto [place, is_new] = there.try_emplace(Key{p, surface}, point);
      if (is_new) return;
      used_[point] = 0;
      same_.emplace_back(point, place->second);
    };
    for (std::size_t piece = 0; piece < pieces_; ++piece) {
      for_each_block(piece, [&](const Front::Block& block) {
        if (is_at_border(block)) for_each_point(block, unite);
      });
    }
  }

  void emit_piece(std::size_t piece, const std::vector<std::uint32_t>& names, std::vector<Tet>& out) const {
    Front::Cursor cursor(front_);
    for_each_block(piece, [&](const Front::Block& block) { emit_block(cursor, block, names, out); });
  }

  // The tetrahedra that splits in this supercube left, their points by name.
  void emit_block(Front::Cursor& cursor, const Front::Block& block, const std::vector<std::uint32_t>& names, std::vector<Tet>& out) const {
    if (block.scale == front_.domain_.levels()) {  // the corners: the mesh is the root's if that is not split
      emit_root(names, out);
      return;
    }
    if (block.shown == 0) return;
    cursor.move_to(block.scale, block.position);
    for (std::uint64_t left = block.shown; left != 0; left &= left - 1) {
      const int slot = std::countr_zero(left);
      const unsigned children = unsplit_children(cursor, slot);
      if (children != 0 && cursor.gather(slot)) emit_halves(cursor, block.of[slot], children, names, out);
    }
  }

  void emit_root(const std::vector<std::uint32_t>& names, std::vector<Tet>& out) const {
    const Diamond root(front_.domain_.root());
    Front::Cursor cursor(front_);
    cursor.move_to(root.scale, {});
    if (!cursor.gather(kSlotOfType[root.type]) || cursor.is_shown()) return;
    PointsAround points;
    gather_points(cursor, names, points);
    for (int t = 0; t < root.row->tets; ++t) {
      if (!(cursor.existing_.tets >> t & 1)) continue;
      const TetShape shape = front_.shape(root, cursor.existing_, t);
      emit(shape, corners_of(shape), cursor.context_.sides, points, out);
    }
  }

  // A bit for each child whose split is not shown.
  [[nodiscard]] unsigned unsplit_children(Front::Cursor& cursor, int slot) const {
    const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
    const Links& links = (*cursor.links_)[slot];
    unsigned unsplit = 0;
    for (int k = 0; k < row.children; ++k) {
      const auto found = cursor.at(links.child[k]);
      unsplit |= unsigned(~found.block->shown >> found.slot & 1) << k;
    }
    return unsplit;
  }

  static void gather_points(const Front::Cursor& cursor, const std::vector<std::uint32_t>& names, PointsAround& points) {
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

  void emit_halves(const Front::Cursor& cursor, const Front::Split& split, unsigned children, const std::vector<std::uint32_t>& names,
                   std::vector<Tet>& out) const {
    const DiamondType& row = *cursor.context_.row;
    const std::uint32_t sides = cursor.context_.sides | std::uint32_t(split.side()) << (2 * kCentre);
    if ((split.bits & Front::kCutBits) == 0 && split.side() != Side::inside) return;  // all on one side, and not inside
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
      for (const Duet::Half& half : row.child[std::countr_zero(children)].half) {
        if (!(cursor.existing_.tets >> half.tet & 1) || cases_.count(ring.half(half.tet, half.end)) == 0) continue;
        if (!cursor.existing_.straddles) {
          emit(row.half_shape[half.tet][half.end], corners[half.tet][half.end], sides, points, out);
        } else if (front_.half_exists(*cursor.diamond_, half.tet, half.end)) {
          const TetShape shape = front_.half_shape(*cursor.diamond_, cursor.existing_, half.tet, half.end);
          emit(shape, corners_of(shape), sides, points, out);
        }
      }
    }
  }

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
  const ParallelFor& parallel_;
  const TetCases& cases_ = tet_cases();
  const HalfCorners& half_corners_ = half_corners();
  std::size_t pieces_;
  std::vector<std::uint8_t> used_;                             // by point: 1 for those of the mesh
  std::vector<std::uint32_t> number_;                          // in the mesh, by point
  std::vector<std::pair<std::uint32_t, std::uint32_t>> same_;  // points that are the same as an earlier one
};

Mesh Front::mesh(const ParallelFor& parallel) const { return FrontMesh(*this, parallel).make(); }

}  // namespace intervale
