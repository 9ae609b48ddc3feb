#include "common/codec/batch.h"

#include <algorithm>

namespace intervale {

int nearness(const KeySides& sides, Refine refine, const VertexKeys& around, int vertices) {
  ValueKey least = kNoKey, greatest = 0;
  for (int v = 0; v < vertices; ++v) {
    least = std::min(least, around[std::size_t(v)]);
    greatest = std::max(greatest, around[std::size_t(v)]);
  }
  const Side low = sides.side(least), high = sides.side(greatest);
  if (low != high || (refine == Refine::uniform && low == Side::inside)) return 0;
  // How many keys further one of the values would lie on another side.
  const auto beyond = [](std::uint64_t a, std::uint64_t b) { return a > b ? a - b : 1; };
  std::uint64_t distance = ~std::uint64_t(0);
  if (low != Side::below) distance = beyond(std::uint64_t(least) + 1, sides.first_inside());
  if (low == Side::below) distance = beyond(sides.first_inside(), greatest);
  if (low == Side::inside) distance = std::min(distance, beyond(sides.first_above(), greatest));
  if (low == Side::above) distance = beyond(std::uint64_t(least) + 1, sides.first_above());
  const std::uint64_t spread = std::uint64_t(greatest - least) + 1;
  return std::clamp(int(std::bit_width(8 * distance / spread)), 1, kNearness - 1);
}

}  // namespace intervale
