#include "client/view/tets_in_box.h"

#include "common/util/tetrahedron.h"

namespace intervale {
TetsInBox tets_in_box(const Skin& skin, const Box& box, std::uint64_t most) {
  const FrontPatches& patches = skin.patches();
  const Grid& grid = patches.grid();
  std::array<double, 3> low, high;  // in samples
  for (int i = 0; i < 3; ++i) {
    low[i] = (box.min[i] - grid.origin[i]) / grid.spacing[i];
    high[i] = (box.max[i] - grid.origin[i]) / grid.spacing[i];
  }
  TetsInBox found;
  std::vector<FrontPatches::Tet> tets;
  for (std::size_t number = 0; number < patches.supercubes(); ++number) {
    const int scale = patches.scale(number);
    const Vertex p = patches.position(number);
    if (scale != patches.domain().levels()) {  // its diamonds reach from h before its corner to 4 h behind
      const double h = double(std::int32_t(1) << scale);
      const std::array<double, 3> corner{4.0 * p.x * h, 4.0 * p.y * h, 4.0 * p.z * h};
      bool apart = false;
      for (int i = 0; i < 3; ++i) apart = apart || corner[i] - h > high[i] || corner[i] + 4 * h < low[i];
      if (apart) continue;
    }
    tets.clear();
    patches.emit(number, FrontPatches::Themselves{}, tets);
    for (const auto& tet : tets) {
      std::array<double, 3> middle{};
      for (const std::uint32_t name : tet) {
        for (int i = 0; i < 3; ++i) middle[i] += skin.position(name)[i] * (0.25 / FrontPatches::kSteps);
      }
      bool inside = true;
      for (int i = 0; i < 3; ++i) inside = inside && middle[i] >= low[i] && middle[i] <= high[i];
      if (!inside || ++found.out_of > most) continue;
      const auto first = std::uint32_t(found.vertices.size());
      for (const std::uint32_t name : tet) {
        const auto& at = skin.position(name);
        found.vertices.push_back({float(at[0]) / FrontPatches::kSteps, float(at[1]) / FrontPatches::kSteps, float(at[2]) / FrontPatches::kSteps,
                                  float(middle[0]), float(middle[1]), float(middle[2]), skin.surface(name), std::uint8_t(scale)});
      }
      for (const auto& face : kTetFaces) found.indices.insert(found.indices.end(), {first + face[0], first + face[1], first + face[2]});
      ++found.count;
    }
  }
  return found;
}

}  // namespace intervale
