#include "common/diamond/surroundings.h"

namespace intervale {

void Surroundings::move_to(SupercubeKey key) {
  if (key == key_) return;
  key_ = key;
  scale_ = scale_of_key(key);
  position_ = position_of_key(key);
  links_ = &link_table()[unsigned(position_.x & 1) | unsigned(position_.y & 1) << 1 | unsigned(position_.z & 1) << 2];
  known_ = 0;
  if (const SupercubeKey brick = key & ~SupercubeKey(63); brick != brick_) {
    brick_ = brick;
    brick_position_ = {position_.x >> 2, position_.y >> 2, position_.z >> 2};
    same_.fill(kUnknown);
    coarser_.fill(kUnknown);
  }
}

void Surroundings::look(int where) {
  known_ |= std::uint64_t(1) << where;
  Seen& seen = seen_[std::size_t(where)];
  seen = {};
  const auto [scale, p] = supercube_at(where, scale_, position_);
  if ((p.x | p.y | p.z) < 0) return;
  const Vertex in{p.x >> 2, p.y >> 2, p.z >> 2};
  const Vertex& from = brick_position_;
  std::uint32_t& brick = where < kCoarser ? same_[std::size_t(in.x - from.x + 1 + 3 * (in.y - from.y + 1) + 9 * (in.z - from.z + 1))]
                                          : coarser_[std::size_t(in.x - (from.x >> 1) + 2 * (in.y - (from.y >> 1)) + 4 * (in.z - (from.z >> 1)))];
  if (brick == kUnknown) brick = set_.find_brick(scale, in).value_or(kNone);
  if (brick == kNone) return;
  const unsigned bit =
      unsigned(p.x & 1) | unsigned(p.y & 1) << 1 | unsigned(p.z & 1) << 2 | unsigned(p.x & 2) << 2 | unsigned(p.y & 2) << 3 | unsigned(p.z & 2) << 4;
  const SupercubeSet::Brick& b = set_.bricks()[brick];
  if (!(b.mask >> bit & 1)) return;
  const std::uint32_t s = b.first_supercube + std::uint32_t(std::popcount(b.mask & ((std::uint64_t(1) << bit) - 1)));
  seen = {b.key + bit, set_.occupancy()[s], brick, s, set_.first(brick, s)};
}

}  // namespace intervale
