#include "common/ivm/vertex_keys.h"

namespace intervale {
namespace {

// At a vertex that is no diamond's centre.
ValueKey corner_key(const IntervalVolume& volume, Vertex at) {
  const Diamond root(volume.domain().root());
  for (int corner = 0; corner < kRootVertices; ++corner) {
    if (root.vertex(corner) == at) return volume.description().corners[std::size_t(corner)];
  }
  return kNoKey;
}

}  // namespace

void gather_vertex_keys(const IntervalVolume& volume, SetNeighbours& around, Slot slot, VertexKeys& keys) {
  const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
  const Links& links = around.links(slot);
  const auto key_at = [&](int v) {
    const auto found = around.at(links.vertex[std::size_t(v)]);
    if (found.supercube.has(found.slot)) return volume.key(found.supercube.index(found.slot));
    return corner_key(volume, Diamond(centre_of(around.scale(), around.position(), slot), around.scale(), kTypeOfSlot[slot]).vertex(v));
  };
  const int vertices = row.vertices;
  if (is_interior(volume.domain(), around.scale(), around.position())) {
    for (int v = 0; v < vertices; ++v) keys[std::size_t(v)] = key_at(v);
    return;
  }
  const Diamond d(centre_of(around.scale(), around.position(), slot), around.scale(), kTypeOfSlot[slot]);
  const std::uint32_t exists = Domain::vertices(row, volume.domain().tets(d));
  for (int v = 0; v < vertices; ++v) keys[std::size_t(v)] = (exists >> v & 1) != 0 ? key_at(v) : kNoKey;
  fill_missing(keys, vertices);
}

}  // namespace intervale
