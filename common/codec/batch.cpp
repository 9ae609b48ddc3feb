#include "common/codec/batch.h"

namespace intervale {

int nearness(const KeySides& sides, Refine refine, const VertexKeys& around, int vertices) {
  KeySpan span{around[0], around[0]};
  for (int v = 1; v < vertices; ++v) span.add(around[std::size_t(v)]);
  return nearness(sides, refine, span);
}

}  // namespace intervale
