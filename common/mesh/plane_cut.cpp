#include "common/mesh/plane_cut.h"

#include <cmath>
#include <cstddef>

namespace intervale {
namespace {

using Vector = std::array<double, 3>;

// For each set of corners that are kept, a bit each: the edges that are cut, from the kept end to the other, in the order of their polygon's corners.
struct Edge {
  std::uint8_t kept, away;
};
struct CutCase {
  std::uint8_t count;
  std::array<Edge, 4> edges;
};
constexpr std::array<CutCase, 16> kCases{{
    {0, {}},
    {3, {{{0, 1}, {0, 2}, {0, 3}}}},
    {3, {{{1, 0}, {1, 3}, {1, 2}}}},
    {4, {{{0, 2}, {0, 3}, {1, 3}, {1, 2}}}},
    {3, {{{2, 0}, {2, 1}, {2, 3}}}},
    {4, {{{0, 3}, {0, 1}, {2, 1}, {2, 3}}}},
    {4, {{{1, 3}, {2, 3}, {2, 0}, {1, 0}}}},
    {3, {{{0, 3}, {1, 3}, {2, 3}}}},
    {3, {{{3, 0}, {3, 2}, {3, 1}}}},
    {4, {{{0, 1}, {0, 2}, {3, 2}, {3, 1}}}},
    {4, {{{1, 0}, {3, 0}, {3, 2}, {1, 2}}}},
    {3, {{{0, 2}, {3, 2}, {1, 2}}}},
    {4, {{{2, 0}, {2, 1}, {3, 1}, {3, 0}}}},
    {3, {{{0, 1}, {2, 1}, {3, 1}}}},
    {3, {{{1, 0}, {3, 0}, {2, 0}}}},
    {0, {}},
}};

bool is_finite(const Vector& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

double length(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }

}  // namespace

Result<void> check_plane(const Plane& plane) {
  if (!is_finite(plane.point) || !is_finite(plane.normal) || !std::isfinite(length(plane.normal)))
    return misuse("the plane of a cut must have finite numbers");
  if (!(length(plane.normal) > 0)) return misuse("the plane of a cut must have a normal other than 0 0 0");
  return {};
}

std::vector<double> distances_beyond(const Mesh& mesh, const Plane& plane) {
  const double l = length(plane.normal);
  const Vector n{plane.normal[0] / l, plane.normal[1] / l, plane.normal[2] / l};
  std::vector<double> distances;
  distances.reserve(mesh.points.size());
  for (const Vector& p : mesh.points)
    distances.push_back(n[0] * (p[0] - plane.point[0]) + n[1] * (p[1] - plane.point[1]) + n[2] * (p[2] - plane.point[2]));
  return distances;
}

Vector crossing(const Vector& kept, double kept_distance, const Vector& away, double away_distance) {
  if (away_distance == 0) return away;
  const double t = kept_distance / (kept_distance - away_distance);
  return {kept[0] + t * (away[0] - kept[0]), kept[1] + t * (away[1] - kept[1]), kept[2] + t * (away[2] - kept[2])};
}

std::vector<TetCut> plane_cut(const Mesh& mesh, const Plane& plane) {
  const std::vector<double> distances = distances_beyond(mesh, plane);
  std::vector<TetCut> cuts;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto& tet = mesh.tets[t];
    unsigned kept = 0;
    for (unsigned i = 0; i < 4; ++i) kept |= unsigned(distances[tet[i]] < 0) << i;
    const CutCase& the_case = kCases[kept];
    TetCut cut{std::uint32_t(t), 0, {}};
    // A corner that lies on the plane is where all cut edges end that lead to it.
    std::uint32_t last = ~0u, first = ~0u;
    for (unsigned i = 0; i < the_case.count; ++i) {
      const std::uint32_t from = tet[the_case.edges[i].kept], to = tet[the_case.edges[i].away];
      const std::uint32_t touched = distances[to] == 0 ? to : ~0u;
      if (touched != ~0u && (touched == last || touched == first)) continue;
      if (cut.count == 0) first = touched;
      last = touched;
      cut.corners[cut.count++] = crossing(mesh.points[from], distances[from], mesh.points[to], distances[to]);
    }
    if (cut.count >= 3) cuts.push_back(cut);
  }
  return cuts;
}

}  // namespace intervale
