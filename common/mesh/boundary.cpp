// Finds the faces of one tetrahedron only by a counting sort of all faces by their smallest point: 4 bytes a face and 4
// a point beside the mesh. A hash table of open faces was rejected: it is smaller on well-ordered meshes, but holds
// half of all faces of a shuffled one, and each of its steps misses the cache.
#include "common/mesh/boundary.h"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "common/util/tetrahedron.h"

namespace intervale {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Faces are numbered 4 * tetrahedron + f.
Triangle face(const Mesh& mesh, std::uint64_t id) {
  const auto& tet = mesh.tets[id / 4];
  const auto& corners = kTetFaces[id % 4];
  return {tet[corners[0]], tet[corners[1]], tet[corners[2]]};
}

std::uint32_t smallest(const Triangle& t) { return std::min({t[0], t[1], t[2]}); }

// The two other points, in order, in one number.
std::uint64_t others(const Triangle& t) {
  const std::uint32_t low = smallest(t), high = std::max({t[0], t[1], t[2]});
  const std::uint32_t middle = t[0] ^ t[1] ^ t[2] ^ low ^ high;
  return std::uint64_t{middle} << 32 | high;
}

// Marks the faces that occur once. Id is the smallest unsigned type that numbers all faces.
template <class Id>
std::vector<bool> single_faces(const Mesh& mesh) {
  const std::uint64_t faces = 4 * std::uint64_t{mesh.tets.size()};
  std::vector<Id> ends(mesh.points.size() + 1, 0);  // ends[p + 1]: at first the number of p's faces, then their end in by_point
  for (std::uint64_t id = 0; id < faces; ++id) ++ends[smallest(face(mesh, id)) + std::size_t{1}];
  // Shifted by one place, so that filling the buckets turns starts into ends and no second array is needed.
  Id start = 0;
  for (auto& end : ends) start = static_cast<Id>(start + std::exchange(end, start));
  std::vector<Id> by_point(faces);
  for (std::uint64_t id = 0; id < faces; ++id) by_point[ends[smallest(face(mesh, id)) + std::size_t{1}]++] = static_cast<Id>(id);

  struct Entry {
    std::uint64_t key;
    Id id;
  };
  std::vector<Entry> bucket;
  std::vector<bool> single(faces, false);
  for (std::size_t point = 0; point < mesh.points.size(); ++point) {
    bucket.clear();
    for (auto i = ends[point]; i < ends[point + 1]; ++i) bucket.push_back({others(face(mesh, by_point[i])), by_point[i]});
    std::sort(bucket.begin(), bucket.end(), [](const Entry& a, const Entry& b) { return a.key < b.key; });
    for (std::size_t i = 0, next; i < bucket.size(); i = next) {
      for (next = i + 1; next < bucket.size() && bucket[next].key == bucket[i].key;) ++next;
      if (next == i + 1) single[bucket[i].id] = true;
    }
  }
  return single;
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> boundary_triangles(const Mesh& mesh) {
  const bool narrow = mesh.tets.size() <= std::numeric_limits<std::uint32_t>::max() / 4;
  const auto single = narrow ? single_faces<std::uint32_t>(mesh) : single_faces<std::uint64_t>(mesh);
  std::vector<Triangle> triangles;
  triangles.reserve(static_cast<std::size_t>(std::count(single.begin(), single.end(), true)));
  for (std::size_t id = 0; id < single.size(); ++id)
    if (single[id]) triangles.push_back(face(mesh, id));
  return triangles;
}

BoundaryMesh boundary_mesh(const Mesh& mesh) {
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  BoundaryMesh boundary{{}, boundary_triangles(mesh)};
  std::vector<std::uint32_t> renumbered(mesh.points.size(), kUnused);
  for (auto& triangle : boundary.triangles) {
    for (auto& point : triangle) {
      auto& number = renumbered[point];
      if (number == kUnused) {
        number = static_cast<std::uint32_t>(boundary.points.size());
        boundary.points.push_back(point);
      }
      point = number;
    }
  }
  return boundary;
}

}  // namespace intervale
