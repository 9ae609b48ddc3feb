#include "common/codec/range_coder.h"

namespace intervale {

void RangeEncoder::carry(Bytes& out) {
  for (std::size_t i = out.size(); i-- > 0 && ++out[i] == 0;) {
  }
}

void RangeEncoder::append(Bytes& out, std::uint32_t word) {
  const std::size_t at = out.size();
  out.resize(at + 4);
  for (std::size_t i = 0; i < 4; ++i) out[at + i] = std::uint8_t(word >> (24 - 8 * i));
}

}  // namespace intervale
