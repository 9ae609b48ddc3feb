#include "client/view/volume_tets.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace intervale {

void VolumeTets::add(const BoundarySurface& surface, std::span<const float> values) {
  const FrontState& front = surface.mesher().state();
  affine_ = front.grid.affine;
  const bool is_mirrored = affine_.is_mirrored();
  const std::uint32_t range = ranges_++ << kRangeShift;
  std::vector<std::uint32_t> numbers(values.size());  // of points that have one, and 1 more
  const auto number_of = [&](PointId id) {
    if (numbers[id] == 0) {
      const auto at = [p = surface.position(id)](std::size_t i) { return float(p[i]) / FrontMesher::kSteps; };
      points_.push_back({at(0), at(1), at(2), values[id]});
      numbers[id] = std::uint32_t(points_.size());
    }
    return numbers[id] - 1;
  };
  FrontMesher::Tets tets;
  for (std::size_t number = 0; number < front.blocks.size(); ++number) {
    tets.clear();
    surface.mesher().append_tets(number, tets);
    if (tets_.size() + tets.size() > kMost) return;
    for (auto& tet : tets) {
      if (is_mirrored) std::swap(tet[2], tet[3]);
      Corners corners;
      std::array<float, 3> centre{};
      for (std::size_t k = 0; k < 4; ++k) {
        corners[k] = number_of(tet[k]);
        const VolumePoint& p = points_[corners[k]];
        centre = {centre[0] + p.x / 4, centre[1] + p.y / 4, centre[2] + p.z / 4};
      }
      corners[0] |= range;
      tets_.push_back(corners);
      centres_.push_back(centre);
    }
  }
}

std::vector<std::uint32_t> VolumeTets::order(const Vec3& eye) const {
  constexpr std::size_t kBins = 65536;
  // In samples of the widest spacing, so that squares do not overflow.
  const Vec3 from = affine_.inverse().point(eye), spacing = affine_.spacing();
  const double unit = std::max({spacing[0], spacing[1], spacing[2]});
  std::array<float, 9> to_world;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) to_world[3 * j + i] = float(affine_.column(j)[i] / unit);
  std::vector<float> distances;
  distances.reserve(centres_.size());
  float least = INFINITY, most = 0;
  for (const auto& centre : centres_) {
    const float x = float(centre[0] - from[0]), y = float(centre[1] - from[1]), z = float(centre[2] - from[2]);
    const std::array<float, 3> d{to_world[0] * x + to_world[3] * y + to_world[6] * z, to_world[1] * x + to_world[4] * y + to_world[7] * z,
                                 to_world[2] * x + to_world[5] * y + to_world[8] * z};
    distances.push_back(std::sqrt(dot(d, d)));
    least = std::min(least, distances.back());
    most = std::max(most, distances.back());
  }
  // A counting sort.
  const float bins = most > least ? float(kBins - 1) / (most - least) : 0;
  const auto bin_of = [&](std::size_t tet) { return std::size_t((most - distances[tet]) * bins); };
  std::vector<std::uint32_t> ends(kBins + 1), order(distances.size());
  for (std::size_t tet = 0; tet < order.size(); ++tet) ++ends[bin_of(tet) + 1];
  for (std::size_t bin = 1; bin < kBins; ++bin) ends[bin] += ends[bin - 1];
  for (std::size_t tet = 0; tet < order.size(); ++tet) order[ends[bin_of(tet)]++] = std::uint32_t(tet);
  return order;
}

}  // namespace intervale
