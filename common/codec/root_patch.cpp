#include "common/codec/root_patch.h"

namespace intervale {

std::vector<std::uint8_t> encode_base(const Base& base) {
  std::vector<std::uint8_t> bytes;
  for (Side s : base.side) bytes.push_back(std::uint8_t(s));
  for (const Cuts& c : base.cuts) bytes.insert(bytes.end(), c.q, c.q + c.count);
  return bytes;
}

Result<Base> decode_base(std::span<const std::uint8_t> bytes, const Domain& domain) {
  Base base;
  if (bytes.size() < kRootVertices) return fail("the base is damaged: fewer bytes than the root has corners");
  for (int i = 0; i < kRootVertices; ++i) {
    if (bytes[i] > 2) return fail("the base is damaged: a corner's side is none");
    base.side[i] = Side(bytes[i]);
  }
  const Diamond root(domain.root());
  const unsigned edges = Domain::edges(*root.row, domain.tets(root));
  std::size_t next = kRootVertices;
  for (int e = 0; e < kRootEdges; ++e) {
    if (!(edges >> e & 1)) continue;
    const auto [a, b] = edge_ends(e, root.row->belt);
    base.cuts[e].count = std::uint8_t(cut_count(base.side[a], base.side[b]));
    for (int i = 0; i < base.cuts[e].count; ++i) {
      if (next == bytes.size()) return fail("the base is damaged: fewer cuts than its corners call for");
      base.cuts[e].q[i] = bytes[next++];
    }
  }
  if (next != bytes.size()) return fail("the base is damaged: more cuts than its corners call for");
  return base;
}

}  // namespace intervale
