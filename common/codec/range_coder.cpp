#include "common/codec/range_coder.h"

namespace intervale {

std::vector<std::uint8_t> RangeEncoder::finish() {
  // Some number in [low_, low_ + range_) whose lower half is 0.
  const std::uint64_t rounded = low_ + 0xffffffffu;
  if (rounded < low_) carry();
  low_ = rounded;
  shift();
  return std::move(out_);
}

void RangeEncoder::carry() {
  for (std::size_t i = out_.size(); i-- > 0 && ++out_[i] == 0;) {
  }
}

void RangeEncoder::shift() {
  for (int s = 56; s >= 32; s -= 8) out_.push_back(std::uint8_t(low_ >> s));
  low_ <<= 32;
  range_ <<= 32;
}

}  // namespace intervale
