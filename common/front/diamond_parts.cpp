#include "common/front/diamond_parts.h"

#include <array>

#include "common/diamond/supercube.h"
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

// Of a diamond whose vertices are clamped, the gaps between coordinates that are left: on each axis, bit 0 from below
// the centre to the centre, bit 1 from there to above it.
unsigned gaps_of(const Domain& domain, const Diamond& d) {
  const Vertex low = domain.clamp({d.centre.x - d.h, d.centre.y - d.h, d.centre.z - d.h}), c = domain.clamp(d.centre),
               high = domain.clamp({d.centre.x + d.h, d.centre.y + d.h, d.centre.z + d.h});
  const auto on_axis = [](std::int32_t below, std::int32_t at, std::int32_t above) { return unsigned(below < at) | unsigned(at < above) << 1; };
  return on_axis(low.x, c.x, high.x) | on_axis(low.y, c.y, high.y) << 2 | on_axis(low.z, c.z, high.z) << 4;
}

// What exists of diamonds, by type and gaps. The volume of a tetrahedron is a sum of products of one gap on each axis.
// As clamping turns no tetrahedron inside out, no product has a negative factor before it: so which gaps are 0 tells
// whether a tetrahedron is flat, however wide the others are.
class PartsTable {
 public:
  PartsTable() {
    for (const std::uint8_t type : kTypeOfSlot) {
      for (unsigned gaps = 0; gaps < kGaps; ++gaps) table_[type][gaps] = parts_with(type, gaps);
    }
  }
  [[nodiscard]] const DiamondParts& of(unsigned type, unsigned gaps) const { return table_[type][gaps]; }

 private:
  static constexpr unsigned kGaps = 64;
  static DiamondParts parts_with(unsigned type, unsigned gaps) {
    const DiamondType& row = diamond_type(type);
    const auto clamped = [gaps](int axis, std::int8_t step) {
      const bool is_left = (gaps >> (2 * axis + (step > 0)) & 1) != 0;
      return is_left ? std::int32_t(step) : 0;
    };
    DiamondParts parts;
    for (int t = 0; t < row.tets; ++t) {
      std::array<Vertex, 4> corners;
      for (std::size_t i = 0; i < 4; ++i) {
        const Offset step = row.vertex[row.tet(t)[i]];
        corners[i] = {clamped(0, step.x), clamped(1, step.y), clamped(2, step.z)};
      }
      parts.tets |= std::uint32_t(Domain::exists(corners)) << t;
    }
    parts.vertices = Domain::vertices(row, parts.tets);
    parts.edges = Domain::edges(row, parts.tets);
    return parts;
  }
  std::array<std::array<DiamondParts, kGaps>, 64> table_{};
};

}  // namespace

DiamondParts parts_of(const Domain& domain, const Diamond& d) {
  if (domain.is_interior(d)) return all_parts(*d.row);
  static const PartsTable table;
  DiamondParts parts = table.of(d.type, gaps_of(domain, d));
  parts.straddles = !domain.is_unmoved(d);
  return parts;
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
      unsigned count = cases.count(ring.half(t, end));
      if (count == 0 || (parts.straddles && !half_exists(domain, d, t, end))) continue;
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
