#include "common/front/diamond_parts.h"

#include <array>

#include "common/patch/tet_cases.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// How many tetrahedra more the patches of a tetrahedron's halves have than its own: by the sides of the spine's ends and
// of the centre, and by those of the two belt vertices.
class AddedTets {
 public:
  static constexpr std::int8_t kDepends = 127;  // the sides do not determine it
  using ByBelt = std::array<std::int8_t, 16>;

  AddedTets() {
    const TetCases& cases = tet_cases();
    for (unsigned i = 0; i < 64; ++i) {
      const unsigned first = i & 3, second = i >> 2 & 3, centre = i >> 4;
      for (unsigned belt = 0; belt < 16; ++belt) {
        const unsigned whole = cases.count(first | second << 2 | belt << 4);
        const unsigned a = cases.count(first | centre << 2 | belt << 4), b = cases.count(second | centre << 2 | belt << 4);
        const bool depends = whole == TetCases::kDepends || a == TetCases::kDepends || b == TetCases::kDepends;
        table_[i][belt] = depends ? kDepends : std::int8_t(int(a) + int(b) - int(whole));
      }
    }
  }
  [[nodiscard]] const ByBelt& of(std::uint32_t sides) const { return table_[(sides & 15) | (sides >> (2 * kCentre) & 3) << 4]; }

 private:
  std::array<ByBelt, 64> table_{};
};

}  // namespace

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

std::int64_t count_added(const Domain& domain, const Diamond& d, const DiamondParts& parts, std::uint32_t sides) {
  static const AddedTets table;
  if (!parts.straddles) {
    const Ring ring(sides, d.row->belt);
    const auto& added = table.of(sides);
    std::int64_t n = 0;
    bool is_known = true;
    for (const int t : set_bits(parts.tets)) {
      const std::int8_t more = added[ring.belt_pair(t)];
      is_known = is_known && more != AddedTets::kDepends;
      n += more;
    }
    if (is_known) return n;
  }
  return std::int64_t(count_halves(domain, d, parts, sides)) - std::int64_t(count_tets(domain, d, parts, sides));
}

}  // namespace intervale
