#include "common/patch/value_format.h"

#include <cmath>

namespace intervale {
namespace {

// The number of a value of type f32.
std::int64_t number_of(float value) {
  std::uint32_t bits = 0;
  const float size = std::fabs(value);
  std::memcpy(&bits, &size, sizeof bits);
  return value < 0 ? -std::int64_t(bits) : std::int64_t(bits);
}
constexpr std::int64_t kFloats = 0x7f7fffff;  // the number of the greatest one
constexpr std::int64_t kExact = std::int64_t(1) << 53;

}  // namespace

ValueKey ValueFormat::key(double value) const {
  const double n = step == 0 ? double(number_of(float(value))) : std::floor(value / step + 0.5);
  if (!(n > double(first))) return 0;
  if (n >= double(first) + double(last)) return last;
  return ValueKey(std::int64_t(n) - first);
}

Result<void> check_value_format(const ValueFormat& format) {
  if (!(format.step >= 0) || !std::isfinite(format.step)) return fail("the step of the values is negative or not finite");
  if (format.last == ~ValueKey(0)) return fail("the values have too many steps: 2^32 - 1 are allowed");
  const std::int64_t most = format.step == 0 ? kFloats : kExact;
  if (format.step == 0 && format.type != SampleType::f32) return fail("the values have no step, which is for samples of type f32");
  if (format.first < -most || format.first > most - std::int64_t(format.last)) return fail("the values are out of range");
  if (!std::isfinite(format.least()) || !std::isfinite(format.greatest())) return fail("the values are not finite");
  if (format.last > 0 && !(format.value(0) < format.value(1) && format.value(format.last - 1) < format.value(format.last))) {
    return fail("the step of the values is too fine for their type");
  }
  return {};
}

}  // namespace intervale
