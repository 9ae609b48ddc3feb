#include "client/view/cross_section.h"

#include <cmath>

#include "common/mesh/plane_cut.h"

namespace intervale {
namespace {

using Tet = FrontMesher::Tet;

class Cutter {
 public:
  Cutter(const BoundarySurface& surface, const CutPlane& plane, std::span<const float> point_values)
      : surface_(surface), point_values_(point_values) {
    const Affine& affine = surface.mesher().state().grid.affine;
    normal_ = affine.transposed(plane.normal);
    offset_ = plane.offset;
    for (std::size_t i = 0; i < 3; ++i) offset_ -= plane.normal[i] * affine.origin()[i];
    is_mirrored_ = affine.is_mirrored();
  }

  CrossSection run() {
    FrontMesher::Tets tets;
    for (std::size_t number = 0; number < surface_.mesher().state().blocks.size(); ++number) {
      const FrontState::Block& block = surface_.mesher().block(number);
      if (!may_meet(block)) continue;
      tets.clear();
      surface_.mesher().append_tets(number, tets);
      lod_ = std::uint8_t(block.scale);
      for (const Tet& tet : tets) cut(tet);
    }
    return std::move(out_);
  }

 private:
  // Its diamonds reach from h before its corner to 4 h behind. What the corners of the domain leave is everywhere.
  [[nodiscard]] bool may_meet(const FrontState::Block& block) const {
    if (surface_.mesher().state().is_root_block(block)) return true;
    const double h = double(std::int32_t(1) << block.scale);
    const Vertex p = block.position;
    const Vec3 low{(4.0 * p.x - 1) * h, (4.0 * p.y - 1) * h, (4.0 * p.z - 1) * h};
    double middle = -offset_, reach = 0;
    for (int i = 0; i < 3; ++i) {
      middle += normal_[i] * (low[i] + 2.5 * h);
      reach += std::abs(normal_[i]) * 2.5 * h;
    }
    return std::abs(middle) <= reach;
  }

  // Tetrahedra are positive in samples too, and an affine map keeps what lies in between: the cut is made there.
  void cut(const Tet& tet) {
    std::array<Vec3, 4> corners;
    std::array<double, 4> distances;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& at = surface_.position(tet[k]);
      corners[k] = scaled(1.0 / FrontMesher::kSteps, {double(at[0]), double(at[1]), double(at[2])});
      distances[k] = dot(normal_, corners[k]) - offset_;
    }
    const TetCut polygon = cut_tet(corners, distances);
    for (std::size_t i = 1; i + 1 < polygon.count; ++i) {
      // The triangle of corners 0, i and i + 1: whether its side opposite to each is a side of the polygon, or else a
      // diagonal.
      const std::array<bool, 3> is_side{true, i + 2 == polygon.count, i == 1};
      const std::array<std::size_t, 3> corner{0, i, i + 1},
          order = is_mirrored_ ? std::array<std::size_t, 3>{0, 2, 1} : std::array<std::size_t, 3>{0, 1, 2};
      for (const std::size_t k : order) {
        const Vec3& p = polygon.corners[corner[k]];
        SectionVertex v{float(p[0]), float(p[1]), float(p[2]), {}, lod_};
        for (std::size_t side = 0; side < 3; ++side) v.side[side] = side == k || !is_side[side] ? 255 : 0;
        out_.vertices.push_back(v);
        if (!point_values_.empty()) out_.values.push_back(value_at(tet, polygon.on[corner[k]]));
      }
    }
  }

  [[nodiscard]] float value_at(const Tet& tet, const CutEdge& on) const {
    const double kept = point_values_[tet[on.kept]], away = point_values_[tet[on.away]];
    return float(kept + on.fraction * (away - kept));
  }

  const BoundarySurface& surface_;
  std::span<const float> point_values_;
  Vec3 normal_;  // so that its product with a place in samples is the distance in world units
  double offset_ = 0;
  bool is_mirrored_ = false;  // what is counterclockwise in samples is not in the world
  std::uint8_t lod_ = 0;
  CrossSection out_;
};

}  // namespace

CrossSection cross_section(const BoundarySurface& surface, const CutPlane& plane, std::span<const float> point_values) {
  return Cutter(surface, plane, point_values).run();
}

}  // namespace intervale
