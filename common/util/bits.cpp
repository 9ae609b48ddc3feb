#include "common/util/bits.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace intervale {
namespace {

std::uint64_t extract_portably(std::uint64_t bits, std::uint64_t mask) {
  std::uint64_t result = 0;
  for (std::uint64_t left = mask, to = 1; left != 0; left &= left - 1, to <<= 1) result |= (bits >> std::countr_zero(left) & 1) != 0 ? to : 0;
  return result;
}
#if defined(__x86_64__)
__attribute__((target("bmi2"))) std::uint64_t extract_bmi2(std::uint64_t bits, std::uint64_t mask) { return _pext_u64(bits, mask); }
const bool kHasBmi2 = __builtin_cpu_supports("bmi2") != 0;
#endif

}  // namespace

std::uint64_t extract_bits(std::uint64_t bits, std::uint64_t mask) {
#if defined(__x86_64__)
  if (kHasBmi2) return extract_bmi2(bits, mask);
#endif
  return extract_portably(bits, mask);
}

}  // namespace intervale
