#include "client/load/verify_meshes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace intervale {
namespace {

constexpr std::size_t kWhole = 4;  // meshes that are compared point by point

// A mesh, independent of how its points and tetrahedra are numbered.
struct Canonical {
  std::vector<std::pair<std::array<double, 3>, Surface>> points;  // ascending
  std::vector<std::array<std::uint32_t, 4>> tets;                 // of these points, each ascending, ascending
  explicit Canonical(const Mesh& mesh);
  friend bool operator==(const Canonical&, const Canonical&) = default;
};

Canonical::Canonical(const Mesh& mesh) {
  std::vector<std::uint32_t> order(mesh.points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto point = [&mesh](std::uint32_t i) { return std::pair(mesh.points[i], mesh.surface[i]); };
  std::ranges::sort(order, {}, point);
  std::vector<std::uint32_t> rank(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = i;
    points.push_back(point(order[i]));
  }
  for (const auto& tet : mesh.tets) {
    std::array<std::uint32_t, 4> named{};
    std::ranges::transform(tet, named.begin(), [&rank](std::uint32_t i) { return rank[i]; });
    std::ranges::sort(named);  // all tetrahedra are positive, so the points determine the orientation
    tets.push_back(named);
  }
  std::ranges::sort(tets);
}

bool has_mesh_of(Front reference, const Front& front) { return reference.coarsen_to(front) && are_equal(reference.mesh(), front.mesh()); }

// whole: whether the meshes themselves are compared.
bool is_right(std::span<const Front> reference, std::span<const Front> fronts, bool whole) {
  return std::ranges::equal(reference, fronts, [whole](const Front& expected, const Front& front) {
    return front.is_part_of(expected) && (!whole || has_mesh_of(expected, front));
  });
}

}  // namespace

bool are_equal(const Mesh& a, const Mesh& b) {
  if (a.points.size() != b.points.size() || a.tets.size() != b.tets.size()) return false;
  return Canonical(a) == Canonical(b);
}

Verified verify_meshes(std::span<const Front> reference, std::span<const std::optional<LoadedMesh>> clients, std::uint64_t seed) {
  std::vector<const StreamClient*> meshes;
  for (const auto& client : clients) {
    if (client) meshes.push_back(&client->client);
  }
  std::shuffle(meshes.begin(), meshes.end(), std::mt19937_64(seed));
  Verified verified;
  for (const StreamClient* client : meshes) {
    const bool whole = verified.compared < kWhole;
    const bool equal = is_right(reference, client->fronts(), whole);
    ++verified.compared;
    if (!equal) ++verified.differing;
  }
  return verified;
}

bool is_mesh_of_range(Front whole, const Front* fresh, const Front& front) {
  return (fresh == nullptr || fresh->is_part_of(front)) && has_mesh_of(std::move(whole), front);
}

}  // namespace intervale
