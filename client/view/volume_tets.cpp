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

// By how much farther each centre is than the first one. With p from the first centre to another one, and e from there to
// the eye, |p - e| - |e| = (|p|^2 - 2 p e) / (|p - e| + |e|). Divided by |e| above and below, nothing overflows or cancels
// however far the eye is.
std::vector<std::uint32_t> VolumeTets::order(const Vec3& eye) const {
  constexpr std::size_t kBins = 65536;
  if (centres_.empty()) return {};
  const auto first = centres_.front();
  // In samples of the widest spacing, so that squares do not overflow.
  const Vec3 spacing = affine_.spacing(), to_eye = subtract(eye, affine_.point({first[0], first[1], first[2]}));
  const double unit = std::max({spacing[0], spacing[1], spacing[2]}), reach = std::max(length(to_eye), unit);
  std::array<float, 9> to_world;
  std::array<float, 3> e;
  for (std::size_t j = 0; j < 3; ++j) {
    e[j] = float(to_eye[j] / reach);
    for (std::size_t i = 0; i < 3; ++i) to_world[3 * j + i] = float(affine_.column(j)[i] / unit);
  }
  const float scale = float(unit / reach), e_length = std::sqrt(dot(e, e));  // scale: at most 1; 0 if the eye is very far
  std::vector<float> distances;
  distances.reserve(centres_.size());
  float least = INFINITY, most = -INFINITY;
  for (const auto& centre : centres_) {
    const float x = centre[0] - first[0], y = centre[1] - first[1], z = centre[2] - first[2];
    const std::array<float, 3> p{to_world[0] * x + to_world[3] * y + to_world[6] * z, to_world[1] * x + to_world[4] * y + to_world[7] * z,
                                 to_world[2] * x + to_world[5] * y + to_world[8] * z};
    const std::array<float, 3> from_eye{p[0] * scale - e[0], p[1] * scale - e[1], p[2] * scale - e[2]};
    const float sum = std::sqrt(dot(from_eye, from_eye)) + e_length;
    distances.push_back(sum > 0 ? (dot(p, p) * scale - 2 * dot(p, e)) / sum : 0);
    least = std::min(least, distances.back());
    most = std::max(most, distances.back());
  }
  // A counting sort.
  const float bins = most > least ? float(kBins - 1) / (most - least) : 0;
  const auto bin_of = [&](std::size_t tet) { return std::min(std::size_t((most - distances[tet]) * bins), kBins - 1); };
  std::vector<std::uint32_t> ends(kBins + 1), order(distances.size());
  for (std::size_t tet = 0; tet < order.size(); ++tet) ++ends[bin_of(tet) + 1];
  for (std::size_t bin = 1; bin < kBins; ++bin) ends[bin] += ends[bin - 1];
  for (std::size_t tet = 0; tet < order.size(); ++tet) order[ends[bin_of(tet)]++] = std::uint32_t(tet);
  return order;
}

}  // namespace intervale
