#include "common/patch/key_sides.h"

namespace intervale {
namespace {

// The first key in [0, last] whose value is one of `those`, or last + 1; with a value, all greater ones are, too.
template <class Those>
std::uint64_t first_of(const ValueFormat& format, const Those& those) {
  std::uint64_t begin = 0, end = std::uint64_t(format.last) + 1;
  while (begin < end) {
    const std::uint64_t middle = (begin + end) / 2;
    if (those(format.value(ValueKey(middle)))) {
      end = middle;
    } else {
      begin = middle + 1;
    }
  }
  return begin;
}

}  // namespace

KeySides::KeySides(const ValueFormat& format, const Range& range)
    : first_inside_(first_of(format, [&range](double value) { return value >= range.alpha; })),
      first_above_(first_of(format, [&range](double value) { return value > range.beta; })) {}

}  // namespace intervale
