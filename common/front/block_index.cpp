#include "common/front/block_index.h"

#include <utility>

namespace intervale {

std::uint32_t& BlockIndex::obtain(int scale, Vertex position) {
  const std::uint64_t key = brick_key(scale, position);
  std::size_t at = find_brick(key);
  if (bricks_[at].brick == kNone) {
    if (2 * (numbers_.size() + 1) > bricks_.size()) {
      grow();
      at = find_brick(key);
    }
    bricks_[at] = {key, std::uint32_t(numbers_.size())};
    if (numbers_.size() == numbers_.capacity()) numbers_.reserve(numbers_.size() + numbers_.size() / 8 + 1);
    numbers_.emplace_back().fill(kNone);
  }
  return numbers_[bricks_[at].brick][place_of(position)];
}

void BlockIndex::grow() {
  std::vector<Entry> before(2 * bricks_.size());
  std::swap(bricks_, before);
  --shift_;
  for (const Entry& entry : before) {
    if (entry.brick != kNone) bricks_[find_brick(entry.key)] = entry;
  }
}

}  // namespace intervale
