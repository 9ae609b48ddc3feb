#include <string>

#include "common/front.h"

namespace intervale {

std::optional<std::string> Front::validate() const {
  std::uint64_t tets = 0;
  for (const auto& [id, handle] : diamonds_) {
    const Header& h = header(handle);
    const auto where = " at (" + std::to_string(h.centre.x) + ", " + std::to_string(h.centre.y) + ", " + std::to_string(h.centre.z) + ")";
    if (std::uint64_t(id_of(h.centre)) != id) return "a diamond is filed under another's name" + where;
    if (h.received == 0) return "a diamond without a tetrahedron is in the front" + where;
    if ((h.received & ~h.tets) != 0) return "a diamond holds a tetrahedron that does not exist" + where;
    const DiamondType& row = diamond_type(h.type);
    const std::uint32_t* const p = points(handle);
    const unsigned vertices = Domain::vertices(row, h.received), edges = Domain::edges(row, h.received);
    for (int v = 0; v < row.vertices; ++v) {
      if (!(vertices >> v & 1) || side(h, v) != Side::inside) continue;
      if (p[v] >= points_.size() || points_[p[v]].surface != Surface::inside) return "an inside vertex has no point" + where;
    }
    for (int e = h.split ? 1 : 0; e < row.edges; ++e) {
      const auto [a, b] = edge_ends(e, row.belt);
      const int n = edges >> e & 1 ? cut_count(side(h, a), side(h, b)) : 0;
      if (n > 0 && std::size_t(p[row.vertices + e]) + n > points_.size()) return "a cut edge has no points" + where;
    }
    tets += h.split ? count_halves(h, row, side(h, kCentre)) : count_tets(h, row);
  }
  if (tets != tet_count_) return "the tetrahedra are miscounted: " + std::to_string(tet_count_) + " for " + std::to_string(tets);
  return {};
}

}  // namespace intervale
