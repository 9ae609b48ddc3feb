#include "common/mesh/join.h"

#include <utility>

namespace intervale {

Mesh joined(std::vector<Mesh> parts) {
  if (parts.empty()) return {};
  if (parts.size() == 1) return std::move(parts.front());
  std::size_t points = 0, tets = 0;
  for (const Mesh& part : parts) {
    points += part.points.size();
    tets += part.tets.size();
  }
  Mesh all;
  all.points.reserve(points);
  all.surface.reserve(points);
  all.value.reserve(points);
  all.tets.reserve(tets);
  all.part.reserve(tets);
  for (const PointArray& channel : parts.front().channels) {
    all.channels.push_back({channel.name, channel.unit, channel.components, {}});
    all.channels.back().value.reserve(points * channel.components);
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Mesh part = std::move(parts[i]);  // freed before the next
    const auto first = std::uint32_t(all.points.size());
    all.points.insert(all.points.end(), part.points.begin(), part.points.end());
    all.surface.insert(all.surface.end(), part.surface.begin(), part.surface.end());
    all.value.insert(all.value.end(), part.value.begin(), part.value.end());
    for (std::size_t c = 0; c < all.channels.size(); ++c) {
      const MeshArray<double>& values = part.channels[c].value;
      all.channels[c].value.insert(all.channels[c].value.end(), values.begin(), values.end());
    }
    for (auto tet : part.tets) {
      for (std::uint32_t& point : tet) point += first;
      all.tets.push_back(tet);
    }
    all.part.insert(all.part.end(), part.tets.size(), std::uint8_t(i));
  }
  return all;
}

}  // namespace intervale
