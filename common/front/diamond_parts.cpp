#include "common/front/diamond_parts.h"

#include "common/patch/tet_cases.h"
#include "common/util/bits.h"

namespace intervale {

DiamondParts parts_of(const Domain& domain, const Diamond& d) {
  if (domain.is_interior(d)) return all_parts(*d.row);
  const unsigned tets = domain.tets(d);
  return {tets, Domain::vertices(*d.row, tets), Domain::edges(*d.row, tets), !domain.is_unmoved(d)};
}

bool half_exists(const Domain& domain, const Diamond& d, int tet, int end) {
  auto local = d.row->tet(tet);
  local[1 - end] = kCentre;
  return Domain::exists(domain.positions(d, local));
}

TetShape tet_shape(const Domain& domain, const Diamond& d, const DiamondParts& parts, int tet) {
  const auto local = d.row->tet(tet);
  return parts.straddles ? shape_of(domain.positions(d, local), local, d.row->belt) : d.row->shape[tet];
}

TetShape half_shape(const Domain& domain, const Diamond& d, const DiamondParts& parts, int tet, int end) {
  if (!parts.straddles) return d.row->half_shape[tet][end];
  auto local = d.row->tet(tet);
  local[1 - end] = kCentre;
  return shape_of(domain.positions(d, local), local, d.row->belt);
}

std::uint64_t count_tets(const Domain& domain, const Diamond& d, const DiamondParts& parts, std::uint32_t sides) {
  const TetCases& cases = tet_cases();
  const Ring ring(sides, d.row->belt);
  std::uint64_t n = 0;
  for (const int t : set_bits(parts.tets)) {
    unsigned count = cases.count(ring.tet(t));
    if (count == TetCases::kDepends) {
      const TetShape s = tet_shape(domain, d, parts, t);
      count = cases.count(s.order, shape_sides(s, sides));
    }
    n += count;
  }
  return n;
}

std::uint64_t count_halves(const Domain& domain, const Diamond& d, const DiamondParts& parts, std::uint32_t sides) {
  const TetCases& cases = tet_cases();
  const Ring ring(sides, d.row->belt);
  std::uint64_t n = 0;
  for (const int t : set_bits(parts.tets)) {
    for (int end = 0; end < 2; ++end) {
      if (parts.straddles && !half_exists(domain, d, t, end)) continue;
      unsigned count = cases.count(ring.half(t, end));
      if (count == TetCases::kDepends) {
        const TetShape s = half_shape(domain, d, parts, t, end);
        count = cases.count(s.order, shape_sides(s, sides));
      }
      n += count;
    }
  }
  return n;
}

}  // namespace intervale
