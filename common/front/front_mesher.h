// The mesh of a front, supercube by supercube: the duets (paper, section 7) of split diamonds with children that are
// not split. Each tetrahedron of a duet is half of one of the parent's, and contributes its patch.
//
// The tetrahedra that a supercube's splits leave stay the same until splits in it, or children of them, are shown or
// hidden. So a mesh that changes is updated by those supercubes alone. Points keep their ids, too, until
// FrontState::point_generation changes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/front/front_cursor.h"
#include "common/front/front_state.h"
#include "common/mesh/mesh.h"
#include "common/patch/tet_cases.h"

namespace intervale {

struct MeshChannel;

class FrontMesher {
 public:
  // Which must outlive it, and may change between calls
  explicit FrontMesher(const FrontState& state) : state_(state) {}

  using Tet = std::array<PointId, 4>;  // positively oriented
  using Tets = MeshArray<Tet>;
  // In 1 / kSteps of a sample: every cut of every edge is a whole number there
  using Position = std::array<std::int32_t, 3>;
  static constexpr std::int32_t kSteps = 512;
  struct Point {
    PointId id = 0;
    Position position{};
    Surface surface = Surface::inside;
    bool on_border = false;  // on a far face of the box, where clamping moves vertices
  };
  // Where a point's values come from: the edge that a cut lies on, and how far from its centre, in 1 / kSteps; a centre
  // itself, at 0. Vertices are not clamped.
  struct Ends {
    Vertex centre, vertex;
    std::int32_t at = 0;
  };
  // Sets the channel's values at a point: as many as it has components, linear between the ends of the point's edge.
  static void set_values(const MeshChannel& channel, const Ends& ends, std::span<double> values);
  struct Run {  // points with the ids [first, first + count)
    PointId first = 0;
    std::uint32_t count = 0;
  };
  // A face of a tetrahedron that lies on a surface, counterclockwise from outside in samples.
  struct Face {
    std::array<PointId, 3> points;
    Surface surface;  // alpha or beta
  };
  // Half of a tetrahedron that a split left, whose diamond can be split and has vertices on different sides.
  struct Half {
    std::array<Vertex, 4> corners;  // in samples
    std::size_t end = 0;            // its patch ends before this tetrahedron, and begins where the half before it ends
  };

  // Supercubes have the numbers of their blocks: 0, 1, ... in the order in which they were added. Number 0 has the
  // domain's corners; what they leave is the root's patch. All functions below append what one supercube's splits left,
  // and leave what is there.
  [[nodiscard]] const FrontState& state() const { return state_; }
  [[nodiscard]] const FrontState::Block& block(std::size_t number) const { return state_.blocks[number]; }

  // The points that its shown splits brought. wanted: by id, 0 for points that may be left out; if empty, none may.
  // ends: gets those of each point that is appended, if it is not null.
  void append_points(std::size_t number, std::vector<Point>& points, std::span<const std::uint8_t> wanted = {},
                     std::vector<Ends>* ends = nullptr) const;
  // The same points, as runs.
  void append_runs(std::size_t number, std::vector<Run>& runs) const;
  // The points that its shown splits removed: the cuts of the edges that they split.
  void append_removed_runs(std::size_t number, std::vector<Run>& runs) const;
  // Its tetrahedra. numbers: of each point the number that stands for it; if empty, the points' ids.
  void append_tets(std::size_t number, Tets& tets, std::span<const std::uint32_t> numbers = {}) const;
  // The faces of its tetrahedra that lie on a surface. In a fraction of the time that the tetrahedra take, for most of
  // what lies inside the surfaces is not visited.
  void append_faces(std::size_t number, std::vector<Face>& faces) const;
  // Its halves that can change, and the tetrahedra in them; also those without any.
  void append_halves(std::size_t number, Tets& tets, std::vector<Half>& halves) const;

  // Whether diamonds of this supercube reach the far faces of the box.
  [[nodiscard]] bool is_at_border(std::size_t number) const;

 private:
  // The mesh points around one diamond: those of its vertices, then each edge's cut by alpha and by beta.
  static constexpr int kCutsFrom = kMaxVertices + 1;
  using PointsAround = std::array<std::uint32_t, kCutsFrom + 2 * (kMaxEdges + kMaxVertices)>;
  // Where among the points around a diamond the corners of a tetrahedron's patch are.
  using Corners = std::array<std::uint8_t, kPatchCorners>;
  // Of the halves of all types' tetrahedra
  using HalfCorners = std::array<std::array<std::array<Corners, 2>, kMaxTets>, kSlots>;
  static Corners corners_of(const TetShape& s);
  static const HalfCorners& half_corners();
  // Numbers: a point's number, as numbers[id]
  template <class Numbers>
  static void gather_points(FrontCursor& cursor, const Numbers& numbers, PointsAround& points);

  static unsigned children_not_shown(FrontCursor& cursor, Slot slot);
  [[nodiscard]] bool is_on_border(Vertex v) const;
  template <class Visit>
  void visit_root(const Visit& visit) const;
  template <class Visit>
  void visit_splits(std::size_t number, std::uint64_t slots, const Visit& visit) const;
  template <class Numbers>
  void append_tets_by(std::size_t number, Tets& tets, const Numbers& numbers) const;
  template <class Numbers>
  static void gather_points_with_centre(FrontCursor& cursor, const Numbers& numbers, PointsAround& points);
  template <class Visit>
  void visit_halves(FrontCursor& cursor, unsigned children, const Visit& visit) const;
  [[nodiscard]] static unsigned children_with_mixed_halves(FrontCursor& cursor, unsigned children);
  [[nodiscard]] Tet* make_room(Tets& tets) const;
  Tet* place_patch(Tet* to, const TetShape& shape, const Corners& corners, std::uint32_t sides, const PointsAround& points) const;
  void append_patch_faces(const TetShape& shape, const Corners& corners, std::uint32_t sides, const PointsAround& points,
                          std::vector<Face>& faces) const;
  void append_cuts(FrontCursor& cursor, const Diamond& d, std::vector<Point>& points, std::span<const std::uint8_t> wanted,
                   std::vector<Ends>* ends) const;
  [[nodiscard]] static bool can_change(FrontCursor& cursor, Vertex centre);

  const FrontState& state_;
  const TetCases& cases_ = tet_cases();
  const HalfCorners& half_corners_ = half_corners();
};

}  // namespace intervale
