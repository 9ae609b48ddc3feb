// A sum of hashes of tetrahedra does not depend on their order. Two sums, with different seeds.
#include "common/mesh/mesh_digest.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace intervale {

std::string mesh_digest(const Mesh& mesh) {
  struct Corner {
    std::array<double, 3> at;
    double surface;
    bool operator<(const Corner& other) const { return std::pair(at, surface) < std::pair(other.at, other.surface); }
  };
  std::array<std::uint64_t, 2> sums{};
  for (const auto& tet : mesh.tets) {
    std::array<Corner, 4> corners;
    for (int k = 0; k < 4; ++k) {
      corners[k] = {mesh.points[tet[k]], double(mesh.surface[tet[k]])};
      for (double& c : corners[k].at) c += 0.0;  // no negative zero
    }
    std::sort(corners.begin(), corners.end());
    for (std::uint64_t seed = 0; seed < 2; ++seed) sums[seed] += XXH64(corners.data(), sizeof corners, seed);
  }
  std::string text;
  for (const std::uint64_t sum : sums) {
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[sum >> shift & 15];
  }
  return text;
}

}  // namespace intervale
