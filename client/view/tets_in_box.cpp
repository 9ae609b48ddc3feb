#include "client/view/tets_in_box.h"
#include "common/view/seen_box.h"

#include <utility>

namespace intervale {

TetsInBox tets_in_box(const BoundarySurface& surface, const Box& box, std::uint64_t most) {
  const FrontState& front = surface.mesher().state();
  const SeenBox seen(box, front.grid);
  const bool is_mirrored = front.grid.affine.is_mirrored();
  TetsInBox found;
  FrontMesher::Tets tets;
  for (std::size_t number = 0; number < front.blocks.size(); ++number) {
    const int scale = front.blocks[number].scale;
    const Vertex p = front.blocks[number].position;
    if (scale != front.domain.levels()) {  // its diamonds reach from h before its corner to 4 h behind
      const double h = double(std::int32_t(1) << scale);
      const Vec3 middle{(4.0 * p.x + 1.5) * h, (4.0 * p.y + 1.5) * h, (4.0 * p.z + 1.5) * h};
      if (!seen.meets(middle, {2.5 * h, 2.5 * h, 2.5 * h})) continue;
    }
    tets.clear();
    surface.mesher().append_tets(number, tets);
    for (auto& tet : tets) {
      if (is_mirrored) std::swap(tet[2], tet[3]);
      Vec3 middle{};
      for (const PointId id : tet) {
        for (int i = 0; i < 3; ++i) middle[i] += surface.position(id)[i] * (0.25 / FrontMesher::kSteps);
      }
      if (!seen.contains(middle) || ++found.out_of > most) continue;
      found.points.insert(found.points.end(), tet.begin(), tet.end());
      for (const PointId id : tet) {
        const auto& at = surface.position(id);
        found.vertices.push_back({float(at[0]) / FrontMesher::kSteps, float(at[1]) / FrontMesher::kSteps, float(at[2]) / FrontMesher::kSteps,
                                  float(middle[0]), float(middle[1]), float(middle[2]), surface.surface(id), std::uint8_t(scale)});
      }
      ++found.count;
    }
  }
  return found;
}

}  // namespace intervale
