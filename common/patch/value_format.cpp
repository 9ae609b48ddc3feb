#include "common/patch/value_format.h"

#include <algorithm>
#include <cmath>
#include <utility>

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

// The key of the nearest value of a table.
ValueKey nearest(const std::vector<double>& table, double value) {
  const auto above = std::lower_bound(table.begin(), table.end(), value);
  if (above == table.end()) return ValueKey(table.size() - 1);
  // Halved: the difference of two doubles can overflow.
  const bool is_nearer_below = above != table.begin() && *above != value && value / 2 - above[-1] / 2 < *above / 2 - value / 2;
  return ValueKey(above - table.begin() - std::ptrdiff_t(is_nearer_below));
}

Result<void> check_table(const ValueFormat& format) {
  const std::vector<double>& table = *format.table;
  if (format.first != 0 || table.size() != std::size_t(format.last) + 1) return fail("the table of values has another size than its format says");
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!std::isfinite(table[i])) return fail("the values are not finite");
    if (table[i] == 0 && std::signbit(table[i])) return fail("the table of values has -0");
    if (i > 0 && !(table[i - 1] < table[i])) return fail("the table of values does not ascend");
  }
  return {};
}

}  // namespace

bool operator==(const ValueFormat& a, const ValueFormat& b) {
  if (a.type != b.type || a.step != b.step || a.first != b.first || a.last != b.last) return false;
  return a.table == b.table || (a.table && b.table && *a.table == *b.table);
}

ValueFormat format_of_table(SampleType type, std::vector<double> values) {
  const auto last = ValueKey(values.size() - 1);
  return {type, 0, 0, last, std::make_shared<const std::vector<double>>(std::move(values))};
}

ValueKey ValueFormat::key(double value) const {
  if (table) return nearest(*table, value);
  const double n = step == 0 ? double(number_of(float(value))) : std::floor(value / step + 0.5);
  if (!(n > double(first))) return 0;
  if (n >= double(first) + double(last)) return last;
  return ValueKey(std::int64_t(n) - first);
}

Result<void> check_value_format(const ValueFormat& format) {
  if (!(format.step >= 0) || !std::isfinite(format.step)) return fail("the step of the values is negative or not finite");
  if (format.last == ~ValueKey(0)) return fail("the values have too many steps: 2^32 - 1 are allowed");
  if (has_table(format.step, format.type) != (format.table != nullptr)) return fail("a table of values is missing, or does not belong there");
  if (format.table) return check_table(format);
  const std::int64_t most = format.step == 0 ? kFloats : kExact;
  if (format.first < -most || format.first > most - std::int64_t(format.last)) return fail("the values are out of range");
  if (!std::isfinite(format.least()) || !std::isfinite(format.greatest())) return fail("the values are not finite");
  if (format.last > 0 && !(format.value(0) < format.value(1) && format.value(format.last - 1) < format.value(format.last))) {
    return fail("the step of the values is too fine for their type");
  }
  return {};
}

}  // namespace intervale
