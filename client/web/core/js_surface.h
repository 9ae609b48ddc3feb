// Boundary surfaces, to JavaScript.
#pragma once

#include <cstddef>
#include <cstdint>

#include "client/view/drawn_range.h"
#include "client/view/point_values.h"
#include "client/web/core/js_values.h"
#include "common/patch/shown_range.h"

namespace intervale {

// A piece's id in messages.ts. range: its index among those shown.
inline double js_piece_id(std::size_t range, std::uint32_t id) { return double(std::uint64_t(id) * kMaxRanges + range); }

// A SurfacePiece of messages.ts, as of the last update of what is drawn.
inline val js_piece(std::size_t range, DrawnRange& drawn, std::uint32_t id, bool edges) {
  const SurfacePiece p = drawn.piece(id, edges);
  val piece = val::object();
  piece.set("id", js_piece_id(range, p.id));
  piece.set("range", double(range));
  piece.set("vertices", buffer_of(p.vertices));
  piece.set("values", drawn.values().empty() ? val::null() : buffer_of(values_of(p.points, drawn.values())));
  piece.set("indices", buffer_of(p.indices));
  piece.set("edges", edges ? buffer_of(p.edges) : val::null());
  piece.set("triangles", array_of(p.triangles));
  piece.set("edgeCounts", array_of(p.edge_counts));
  piece.set("min", array_of(p.min));
  piece.set("max", array_of(p.max));
  return piece;
}

}  // namespace intervale
