#include "server/builder/exact_step.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <vector>

namespace intervale {
namespace {

// Where a number lies that is known only up to rounding: a multiple of the step, or the step. low <= high.
struct Interval {
  double low = 0, high = 0;
  [[nodiscard]] double middle() const { return low + (high - low) / 2; }
  [[nodiscard]] bool is_empty() const { return low > high; }
};

// The numbers that become `value` when they are rounded to the type; of f64 those next to it.
Interval before_rounding(SampleType type, double value) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  if (type == SampleType::f64) return {std::nextafter(value, -kInf), std::nextafter(value, kInf)};
  const auto single = float(value);
  const double below = std::nextafter(single, -float(kInf)), above = std::nextafter(single, float(kInf));
  return {std::isinf(below) ? value : (value + below) / 2, std::isinf(above) ? value : (value + above) / 2};
}

Interval difference(const Interval& a, const Interval& b) { return {a.low - b.high, a.high - b.low}; }

// The numbers of steps that `multiple` may be, at least 1; empty if there are none.
Interval counts(const Interval& step, const Interval& multiple) {
  constexpr double kRoom = 0x1p-50;  // for the rounding of these quotients
  return {std::max(1.0, std::ceil(multiple.low / step.high * (1 - kRoom))), std::floor(multiple.high / step.low * (1 + kRoom))};
}

// Removes the steps of which `multiple` is none; false if none is left. Where it may be several multiples, nothing is
// removed.
bool narrow(Interval& step, const Interval& multiple) {
  const Interval count = counts(step, multiple);
  if (count.low == count.high) step = {std::max(step.low, multiple.low / count.low), std::min(step.high, multiple.high / count.low)};
  return !count.is_empty() && step.low <= step.high * (1 + 0x1p-50);
}

// Euclid's algorithm on numbers known up to rounding. multiples: ascending; least: of the steps wanted.
std::optional<Interval> common_divisor(const std::vector<Interval>& multiples, double least) {
  constexpr int kMostSteps = 64;  // each halves the divisor
  Interval step{std::max(multiples[0].low, least), multiples[0].high};
  int steps = 0;
  for (std::size_t i = 0; i < multiples.size(); ++i) {
    if (step.high < least || steps > kMostSteps) return std::nullopt;
    const Interval& multiple = multiples[i];
    if (narrow(step, multiple)) continue;
    const double middle = step.middle(), times = std::round(multiple.middle() / middle), rest = std::fabs(multiple.middle() - times * middle);
    const double tolerance = (multiple.high - multiple.low) / 2 + times * (step.high - step.low) / 2;
    step = {std::max(rest - tolerance, least), rest + tolerance};
    i = std::size_t(-1);  // from the start: the divisor so far is a multiple of the new one too
    ++steps;
  }
  return step;
}

class Search {
 public:
  Search(SampleType type, std::span<const double> values, ValueKey most) : type_(type), values_(values), most_(most) {
    sizes_.reserve(values.size());
    for (const double v : values) {
      if (v != 0) sizes_.push_back(std::fabs(v));
    }
    std::sort(sizes_.begin(), sizes_.end());
  }

  [[nodiscard]] std::optional<ValueFormat> run() const {
    if (values_.size() == 1) return verified(values_[0] == 0 ? 1 : std::fabs(values_[0]));
    if (std::isfinite(values_.back() - values_.front())) {
      if (auto found = rounded_multiples()) return found;
    }
    return exact_multiples();
  }

 private:
  // A step whose multiples the values are after rounding.
  [[nodiscard]] std::optional<ValueFormat> rounded_multiples() const {
    const double least = std::max((values_.back() - values_.front()) / (double(most_) + 1), std::numeric_limits<double>::min());
    auto step = common_divisor(differences(), least);
    if (step && narrow_by_all(*step)) {
      if (auto found = best_in(*step)) return found;
      if (auto found = by_multiple(*step)) return found;
    }
    return by_multiple({least, before_rounding(type_, sizes_[0]).high});
  }

  [[nodiscard]] bool narrow_by_all(Interval& step) const {
    // Long distances say more, once short ones tell how many steps they are.
    return std::all_of(values_.begin() + 1, values_.end(), [&](double v) { return narrow(step, distance(values_[0], v)); }) &&
           std::all_of(sizes_.begin(), sizes_.end(), [&](double size) { return narrow(step, before_rounding(type_, size)); });
  }

  // From a value to a greater one.
  [[nodiscard]] Interval distance(double from, double to) const { return difference(before_rounding(type_, to), before_rounding(type_, from)); }

  // Distances of neighbours, and the smallest value, ascending. All values are sums of multiples of these.
  [[nodiscard]] std::vector<Interval> differences() const {
    std::vector<Interval> result{before_rounding(type_, sizes_[0])};
    result.reserve(values_.size());
    for (std::size_t i = 1; i < values_.size(); ++i) result.push_back(distance(values_[i - 1], values_[i]));
    std::sort(result.begin(), result.end(), [](const Interval& a, const Interval& b) { return a.low < b.low; });
    return result;
  }

  // Where distances leave open how many steps the smallest value is: tries every number, the coarsest steps first. Most
  // are refuted by the next few values.
  [[nodiscard]] std::optional<ValueFormat> by_multiple(const Interval& within) const {
    constexpr double kMostTrials = 1 << 20;
    const Interval smallest = before_rounding(type_, sizes_[0]), count = counts(within, smallest);
    if (count.high - count.low > kMostTrials) return std::nullopt;
    for (double k = count.low; k <= count.high; ++k) {
      Interval step{std::max(within.low, smallest.low / k), std::min(within.high, smallest.high / k)};
      if (!std::all_of(sizes_.begin(), sizes_.end(), [&](double size) { return narrow(step, before_rounding(type_, size)); })) continue;
      if (auto found = best_in(step)) return found;
    }
    return std::nullopt;
  }

  // The simplest step of an interval that gives the values back.
  [[nodiscard]] std::optional<ValueFormat> best_in(const Interval& interval) const {
    const double middle = interval.middle();
    std::vector<double> simple{std::round(middle)};
    if (middle > 0x1p-24 && middle < 1) simple.push_back(1 / std::round(1 / middle));
    constexpr int kShort = 5, kLong = 11;  // digits after the first one
    for (int digits = 0; digits <= kLong; ++digits) {
      char text[32];
      std::snprintf(text, sizeof text, "%.*e", digits, middle);
      simple.push_back(std::strtod(text, nullptr));
      if (digits == kShort) simple.push_back(double(float(middle)));  // of values computed as float * k
    }
    constexpr int kNeighbours = 4;  // doubles: an interval of f64 is no wider
    double near = middle;
    for (int i = 0; i < kNeighbours; ++i) near = std::nextafter(near, 0);
    for (int i = -kNeighbours; i <= kNeighbours; ++i) {
      simple.push_back(near);
      near = std::nextafter(near, std::numeric_limits<double>::infinity());
    }
    for (const double step : simple) {
      if (step < interval.low * (1 - 0x1p-50) || step > interval.high * (1 + 0x1p-50)) continue;
      if (auto found = verified(step)) return found;
    }
    return std::nullopt;
  }

  // The greatest common divisor of the values, which are whole multiples of a power of two.
  [[nodiscard]] std::optional<ValueFormat> exact_multiples() const {
    constexpr int kDigits = std::numeric_limits<double>::digits;
    int unit = std::numeric_limits<int>::max();  // the power of two
    for (const double size : sizes_) {
      int exponent = 0;
      const auto mantissa = std::uint64_t(std::ldexp(std::frexp(size, &exponent), kDigits));
      unit = std::min(unit, exponent - kDigits + std::countr_zero(mantissa));
    }
    if (std::ilogb(sizes_.back()) - unit >= 63) return std::nullopt;
    std::uint64_t divisor = 0;
    for (const double size : sizes_) divisor = std::gcd(divisor, std::uint64_t(std::ldexp(size, -unit)));
    return verified(std::ldexp(double(divisor), unit));
  }

  // The format of a step, if it gives all values back.
  [[nodiscard]] std::optional<ValueFormat> verified(double step) const {
    constexpr double kExact = 0x1p53;
    const double first = std::round(values_.front() / step), last = std::round(values_.back() / step);
    if (!(std::fabs(first) <= kExact && std::fabs(last) <= kExact && last - first <= double(most_))) return std::nullopt;
    const ValueFormat format{type_, step, std::int64_t(first), ValueKey(last - first)};
    if (!check_value_format(format)) return std::nullopt;
    const bool exact = std::all_of(values_.begin(), values_.end(), [&format](double v) { return format.value(format.key(v)) == v; });
    return exact ? std::optional(format) : std::nullopt;
  }

  SampleType type_;
  std::span<const double> values_;
  ValueKey most_;
  std::vector<double> sizes_;  // the values without 0 and without signs, ascending
};

}  // namespace

std::optional<ValueFormat> find_exact_format(SampleType type, std::span<const double> values, ValueKey most) {
  return Search(type, values, most).run();
}

}  // namespace intervale
