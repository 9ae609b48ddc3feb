#include "common/patch/tet_cases.h"

#include <algorithm>
#include <map>

#include "common/util/tetrahedron.h"

namespace intervale {
namespace {

constexpr int kEdge[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};

using Polygon = std::vector<PatchCorner>;

// Places 0..9 are the vertices, then the midpoints of the edges. Whether place a comes before place b in the given
// order.
bool place_less(int order, int a, int b) {
  constexpr int ends[10][2] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  if (a == b) return false;
  const auto [a0, a1] = ends[a];
  const auto [b0, b1] = ends[b];
  if (a0 <= b0 && a1 <= b1) return true;  // vertices ascend, so this decides
  if (b0 <= a0 && b1 <= a1) return false;
  // What remains: an edge whose ends enclose the other place.
  const bool a_spans = a0 < b0;
  const int s0 = a_spans ? a0 : b0, s1 = a_spans ? a1 : b1, m0 = a_spans ? b0 : a0, m1 = a_spans ? b1 : a1;
  int bit = 0;
  if (s0 == 0 && s1 == 2)
    bit = 0;  // midpoint 02 against vertex 1
  else if (s0 == 1)
    bit = 4;  // midpoint 13 against vertex 2
  else
    bit = m0 == 1 && m1 == 1 ? 1 : m0 == 1 ? 2 : 3;  // midpoint 03 against vertex 1, midpoint 12, vertex 2
  const bool span_is_lower = (order >> bit & 1) != 0;
  return span_is_lower == a_spans;
}

int rank(int order, PatchCorner corner) {
  const int place = corner < 4 ? corner : 4 + (corner - 4) / 2;
  int lower = 0;
  for (int other = 0; other < 10; ++other) lower += place_less(order, other, place);
  return 2 * lower + (corner < 4 ? 0 : (corner - 4) % 2);
}

// The part of a face inside the range.
Polygon clip(const std::array<std::uint8_t, 3>& face, const std::array<Side, 4>& side) {
  Polygon polygon;
  for (int i = 0; i < 3; ++i) {
    const int a = face[i], b = face[(i + 1) % 3];
    const auto alpha = PatchCorner(4 + 2 * kEdge[a][b]), beta = PatchCorner(alpha + 1);
    if (side[a] == Side::inside) polygon.push_back(PatchCorner(a));
    const bool rises = side[a] < side[b];
    if (!rises && beta_cuts(side[a], side[b])) polygon.push_back(beta);
    if (alpha_cuts(side[a], side[b])) polygon.push_back(alpha);
    if (rises && beta_cuts(side[a], side[b])) polygon.push_back(beta);
  }
  return polygon;
}

// The polygon of one surface, 0 alpha or 1 beta: its sides are the open sides of the clipped faces, reversed.
Polygon section(const std::vector<Polygon>& faces, int which) {
  std::map<PatchCorner, PatchCorner> next;
  const auto on = [which](PatchCorner c) { return c >= 4 && (c - 4) % 2 == which; };
  for (const Polygon& f : faces) {
    for (std::size_t i = 0; i < f.size(); ++i) {
      const PatchCorner p = f[i], q = f[(i + 1) % f.size()];
      if (on(p) && on(q)) next[q] = p;
    }
  }
  Polygon polygon;
  if (next.empty()) return polygon;
  PatchCorner c = next.begin()->first;
  do {
    polygon.push_back(c);
    c = next.at(c);
  } while (c != polygon.front());
  return polygon;
}

std::vector<std::array<PatchCorner, 4>> tetrahedra(int order, const std::array<Side, 4>& side) {
  std::vector<Polygon> faces;
  for (const auto& face : kTetFaces) {
    Polygon p = clip(face, side);
    if (p.size() >= 3) faces.push_back(std::move(p));
  }
  const Polygon alpha = section(faces, 0), beta = section(faces, 1);
  if (!alpha.empty()) faces.push_back(alpha);
  if (!beta.empty()) faces.push_back(beta);
  const auto lower = [order](PatchCorner a, PatchCorner b) { return rank(order, a) < rank(order, b); };
  std::vector<std::array<PatchCorner, 4>> result;
  if (faces.empty()) return result;
  PatchCorner apex = faces[0][0];
  for (const Polygon& f : faces) {
    for (PatchCorner c : f) apex = lower(c, apex) ? c : apex;
  }
  for (Polygon& f : faces) {
    std::rotate(f.begin(), std::min_element(f.begin(), f.end(), lower), f.end());
    if (std::find(f.begin(), f.end(), apex) != f.end()) continue;
    for (std::size_t i = 1; i + 1 < f.size(); ++i) result.push_back({apex, f[0], f[i], f[i + 1]});
  }
  return result;
}

// Faces of tetrahedra whose corners are all on one surface. No two tetrahedra share such a face.
std::vector<std::array<PatchCorner, 3>> faces_on_surfaces(const std::vector<std::array<PatchCorner, 4>>& tets) {
  std::vector<std::array<PatchCorner, 3>> result;
  result.reserve(4 * tets.size());
  for (const auto& tet : tets) {
    for (const auto& face : kTetFaces) {
      const std::array<PatchCorner, 3> corners{tet[face[0]], tet[face[1]], tet[face[2]]};
      const auto is_on = [first = corners[0]](PatchCorner c) { return c >= 4 && c % 2 == first % 2; };
      if (std::all_of(corners.begin(), corners.end(), is_on)) result.push_back(corners);
    }
  }
  return result;
}

}  // namespace

TetCases::TetCases() : entries_(kTetOrders * 256) {
  for (int order = 0; order < kTetOrders; ++order) {
    for (unsigned sides = 0; sides < 256; ++sides) {
      std::array<Side, 4> side{};
      bool valid = true;
      for (int i = 0; i < 4; ++i) {
        valid = valid && (sides >> (2 * i) & 3) < 3;
        side[i] = Side(sides >> (2 * i) & 3);
      }
      if (!valid) continue;
      const auto tets = tetrahedra(order, side);
      const auto faces = faces_on_surfaces(tets);
      entries_[order * 256 + sides] = {std::uint16_t(tets_.size()), std::uint16_t(faces_.size()), std::uint8_t(tets.size()),
                                       std::uint8_t(faces.size())};
      tets_.insert(tets_.end(), tets.begin(), tets.end());
      faces_.insert(faces_.end(), faces.begin(), faces.end());
      most_ = std::max(most_, unsigned(tets.size()));
    }
  }
  for (unsigned sides = 0; sides < 256; ++sides) {
    unsigned there = 0;
    for (int i = 0; i < 4; ++i) there |= 1u << (sides >> (2 * i) & 3);
    counts_[sides] = std::uint8_t(there == 7 ? kDepends : count(0, sides));
  }
}

const TetCases& tet_cases() {
  static const TetCases table;
  return table;
}

}  // namespace intervale
