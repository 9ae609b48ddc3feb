#include "client/view/tets_in_box.h"

namespace intervale {

TetsInBox tets_in_box(const BoundarySurface& surface, const Box& box, std::uint64_t most) {
  const FrontState& front = surface.mesher().state();
  const Grid& grid = front.grid;
  std::array<double, 3> low, high;  // in samples
  for (int i = 0; i < 3; ++i) {
    low[i] = (box.min[i] - grid.origin[i]) / grid.spacing[i];
    high[i] = (box.max[i] - grid.origin[i]) / grid.spacing[i];
  }
  TetsInBox found;
  FrontMesher::Tets tets;
  for (std::size_t number = 0; number < front.blocks.size(); ++number) {
    const int scale = front.blocks[number].scale;
    const Vertex p = front.blocks[number].position;
    if (scale != front.domain.levels()) {  // its diamonds reach from h before its corner to 4 h behind
      const double h = double(std::int32_t(1) << scale);
      const std::array<double, 3> corner{4.0 * p.x * h, 4.0 * p.y * h, 4.0 * p.z * h};
      bool apart = false;
      for (int i = 0; i < 3; ++i) apart = apart || corner[i] - h > high[i] || corner[i] + 4 * h < low[i];
      if (apart) continue;
    }
    tets.clear();
    surface.mesher().append_tets(number, tets);
    for (const auto& tet : tets) {
      std::array<double, 3> middle{};
      for (const PointId id : tet) {
        for (int i = 0; i < 3; ++i) middle[i] += surface.position(id)[i] * (0.25 / FrontMesher::kSteps);
      }
      bool inside = true;
      for (int i = 0; i < 3; ++i) inside = inside && middle[i] >= low[i] && middle[i] <= high[i];
      if (!inside || ++found.out_of > most) continue;
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
