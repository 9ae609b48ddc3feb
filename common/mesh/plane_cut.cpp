#include "common/mesh/plane_cut.h"

#include <cmath>
#include <span>

namespace intervale {
namespace {

// By the set of kept corners, a bit each: the edges that are cut, from the kept end to the other, in the order of the
// polygon's corners.
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

}  // namespace

Result<void> check_plane(const Plane& plane) {
  if (!is_finite(plane.point) || !is_finite(plane.normal) || !std::isfinite(length(plane.normal)))
    return misuse("the plane of a cut must have finite numbers");
  if (!(length(plane.normal) > 0)) return misuse("the plane of a cut must have a normal other than 0 0 0");
  return {};
}

std::vector<double> plane_distances(const Mesh& mesh, const Plane& plane) {
  const Vec3 normal = normalized(plane.normal);
  std::vector<double> distances;
  distances.reserve(mesh.points.size());
  for (const Vec3& p : mesh.points) distances.push_back(dot(normal, subtract(p, plane.point)));
  return distances;
}

Vec3 crossing(const Vec3& kept, double kept_distance, const Vec3& away, double away_distance) {
  if (away_distance == 0) return away;
  return lerp(kept, away, kept_distance / (kept_distance - away_distance));
}

TetCut cut_tet(const std::array<Vec3, 4>& corners, const std::array<double, 4>& distances) {
  unsigned kept = 0;
  for (unsigned i = 0; i < 4; ++i) kept |= unsigned(distances[i] < 0) << i;
  const CutCase& cut_case = kCases[kept];
  TetCut cut;
  // All cut edges that lead to a corner in the plane end there: they give one corner of the polygon.
  constexpr std::uint8_t kNone = 4;
  std::uint8_t first = kNone, last = kNone;
  for (unsigned i = 0; i < cut_case.count; ++i) {
    const auto [from, to] = cut_case.edges[i];
    const std::uint8_t touched = distances[to] == 0 ? to : kNone;
    if (touched != kNone && (touched == last || touched == first)) continue;
    if (cut.count == 0) first = touched;
    last = touched;
    cut.on[cut.count] = {from, to, distances[from] / (distances[from] - distances[to])};
    cut.corners[cut.count++] = crossing(corners[from], distances[from], corners[to], distances[to]);
  }
  if (cut.count < 3) cut.count = 0;
  return cut;
}

std::vector<TetCut> plane_cut(const Mesh& mesh, const Plane& plane) {
  const std::vector<double> distances = plane_distances(mesh, plane);
  std::vector<TetCut> cuts;
  for (const auto& tet : mesh.tets) {
    const auto& [a, b, c, d] = tet;
    TetCut cut = cut_tet({mesh.points[a], mesh.points[b], mesh.points[c], mesh.points[d]}, {distances[a], distances[b], distances[c], distances[d]});
    if (cut.count == 0) continue;
    for (CutEdge& edge : std::span(cut.on).first(cut.count)) edge = {tet[edge.kept], tet[edge.away], edge.fraction};
    cuts.push_back(cut);
  }
  return cuts;
}

}  // namespace intervale
