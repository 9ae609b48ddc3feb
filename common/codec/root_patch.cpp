#include "common/codec/root_patch.h"

namespace intervale {

std::vector<std::uint8_t> encode_root_patch(const RootPatch& root_patch) {
  std::vector<std::uint8_t> bytes;
  for (Side s : root_patch.side) bytes.push_back(std::uint8_t(s));
  for (const Cuts& c : root_patch.cuts) bytes.insert(bytes.end(), c.q, c.q + c.count);
  return bytes;
}

Result<RootPatch> decode_root_patch(std::span<const std::uint8_t> bytes, const Domain& domain) {
  RootPatch root_patch;
  if (bytes.size() < kRootVertices) return fail("the root patch is damaged: fewer bytes than the root has corners");
  for (int i = 0; i < kRootVertices; ++i) {
    if (bytes[i] > 2) return fail("the root patch is damaged: a corner's side is not 0, 1 or 2");
    root_patch.side[i] = Side(bytes[i]);
  }
  const Diamond root(domain.root());
  const unsigned edges = Domain::edges(*root.row, domain.tets(root));
  std::size_t next = kRootVertices;
  for (int e = 0; e < kRootEdges; ++e) {
    if (!(edges >> e & 1)) continue;
    const auto [a, b] = edge_ends(e, root.row->belt);
    root_patch.cuts[e].count = std::uint8_t(cut_count(root_patch.side[a], root_patch.side[b]));
    for (int i = 0; i < root_patch.cuts[e].count; ++i) {
      if (next == bytes.size()) return fail("the root patch is damaged: fewer cuts than its corners call for");
      root_patch.cuts[e].q[i] = bytes[next++];
    }
  }
  if (next != bytes.size()) return fail("the root patch is damaged: more cuts than its corners call for");
  return root_patch;
}

}  // namespace intervale
