// Where the vertices, edges and children of a supercube's diamonds are kept, by one table.
//
// Every vertex of a diamond is itself the centre of a diamond that was split before (or a corner of the domain), and every edge came into being when
// the younger of its ends was inserted: it is one of that diamond's subdivision edges. So all that a diamond must know of its surroundings is found
// in its vertices' updates, and where those are follows from the diamond's slot and the parity of its supercube's position: in one of the 27
// supercubes around its own, in one of 8 of the next coarser scale, or, for a vertex that is 0 modulo 4h, at one of the 8 corners of the supercube.
// Children are of the same scale, or in one of 27 of the next finer one.
#pragma once

#include <array>
#include <cstdint>

#include "common/diamond/diamond.h"
#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"

namespace intervale {

// Where something is kept, seen from a supercube at position P, of cells 4h wide.
//   kSame + (x + 1) + 3 (y + 1) + 9 (z + 1): the supercube at P + (x, y, z), of the same scale; x, y, z in {-1, 0, 1}
//   kCoarser + x + 2 y + 4 z:                the one at P / 2 + (x, y, z), of the next coarser scale; x, y, z in {0, 1}
//   kCorner + x + 2 y + 4 z:                 the grid vertex at 4h (P + (x, y, z)), wherever that is
//   kFiner + (x + 1) + 3 (y + 1) + 9 (z + 1): the one at 2 P + (x, y, z), of the next finer scale; x, y, z in {-1, 0, 1}
inline constexpr int kSame = 0, kCoarser = 27, kCorner = 35, kFiner = 43, kWheres = 70;
inline constexpr int kHere = 13;  // the supercube itself

struct Link {
  std::uint8_t where = 0;
  std::uint8_t slot = 0;  // in that supercube; 0 and without meaning for a corner
};

// The surroundings of the diamond in one slot.
struct Links {
  std::array<Link, kMaxVertices> vertex{};         // by local vertex
  std::array<std::uint8_t, kMaxParents> parent{};  // local numbers of those vertices that are parents
  struct Edge {
    std::uint8_t owner = 0;  // local number of the younger end
    std::uint8_t other = 0;  // what the older end is to the owner's diamond: its local number there
    std::uint8_t flip = 0;   // 255 if the edge's first end is the older one, so that places of cuts want turning round; else 0
  };
  std::array<Edge, kMaxEdges> edge{};      // by local edge
  std::array<Link, kMaxChildren> child{};  // by number of the child
};

// The scale and position of the supercube at `where` (no corner) from another one; outside the domain the position is negative, or the scale is.
struct SupercubePlace {
  int scale = 0;
  Vertex position;
};
[[nodiscard]] inline SupercubePlace supercube_at(int where, int scale, Vertex p) {
  if (where < kCoarser) return {scale, {p.x + where % 3 - 1, p.y + where / 3 % 3 - 1, p.z + where / 9 - 1}};
  if (where >= kFiner) {
    const int w = where - kFiner;
    return {scale - 1, {2 * p.x + w % 3 - 1, 2 * p.y + w / 3 % 3 - 1, 2 * p.z + w / 9 - 1}};
  }
  const int w = where - kCoarser;
  return {scale + 1, {(p.x >> 1) + (w & 1), (p.y >> 1) + (w >> 1 & 1), (p.z >> 1) + (w >> 2)}};
}

// Whether all diamonds of a supercube lie inside the box: they reach from h before its corner to 4 h behind.
[[nodiscard]] inline bool is_interior(const Domain& domain, int scale, Vertex p) {
  const auto corner = [scale](std::int32_t cells, std::int32_t more) { return (cells * 4 + more) * (std::int32_t(1) << scale); };
  return domain.contains({corner(p.x, -1), corner(p.y, -1), corner(p.z, -1)}) && domain.contains({corner(p.x, 4), corner(p.y, 4), corner(p.z, 4)});
}

// Row for a slot of a supercube whose position has the parities p = (x & 1) + 2 (y & 1) + 4 (z & 1). The table is made at first use.
using LinkTable = std::array<std::array<Links, kSlots>, 8>;
[[nodiscard]] const LinkTable& link_table();

}  // namespace intervale
