#include "server/builder/value_steps.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include "common/patch/visit_samples.h"
#include "common/util/decimal.h"
#include "server/builder/exact_step.h"
#include "server/builder/sample_range.h"

namespace intervale {
namespace {

constexpr int kDefaultBits = 11;       // 2^11 steps or more where nothing else is asked for
constexpr double kMostSteps = 0x1p53;  // from 0: whole numbers that a double distinguishes

using Indices = tbb::blocked_range<std::size_t>;

// Distinct numbers of type T, up to one more than kMostExact. -0 is 0.
template <class T>
class DistinctSet {
 public:
  DistinctSet() : slots_(4 * kMostExact, kFree) {}
  [[nodiscard]] bool is_full() const { return size_ > kMostExact; }
  // Only while it is not full.
  void insert(T value) {
    value += T(0);  // -0 becomes 0
    if (value == last_) return;
    last_ = value;
    std::size_t i = hash(value);
    while (!std::isinf(slots_[i]) && slots_[i] != value) i = (i + 1) % slots_.size();
    size_ += std::isinf(slots_[i]);
    slots_[i] = value;
  }
  void append_to(std::vector<double>& values) const {
    for (const T v : slots_) {
      if (!std::isinf(v)) values.push_back(double(v));
    }
  }

 private:
  static constexpr T kFree = std::numeric_limits<T>::infinity();
  static std::size_t hash(T value) {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    return std::size_t(std::uint64_t(std::bit_cast<Bits>(value)) * 0x9e3779b97f4a7c15 >> 46);  // 18 bits: a slot
  }
  static_assert(4 * kMostExact == std::size_t(1) << 18);
  std::vector<T> slots_;
  std::size_t size_ = 0;
  T last_ = kFree;
};

// The distinct samples, ascending; none if there are more than kMostExact.
template <class T>
std::vector<double> few_distinct(std::span<const T> samples) {
  tbb::enumerable_thread_specific<DistinctSet<T>> sets;
  std::atomic<bool> too_many = false;
  tbb::parallel_for(Indices(0, samples.size(), kSamplesAtOnce), [&](const Indices& part) {
    DistinctSet<T>& set = sets.local();
    if (too_many.load(std::memory_order_relaxed)) return;
    for (std::size_t i = part.begin(); i < part.end() && !set.is_full(); ++i) set.insert(samples[i]);
    if (set.is_full()) too_many.store(true, std::memory_order_relaxed);
  });
  if (too_many) return {};
  std::vector<double> values;
  for (const DistinctSet<T>& set : sets) set.append_to(values);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  if (values.size() > kMostExact) values.clear();
  return values;
}

// The distinct samples, ascending.
template <class T>
std::vector<double> all_distinct(std::span<const T> samples) {
  std::vector<double> values(samples.begin(), samples.end());
  for (double& v : values) v += 0.0;  // -0 becomes 0
  tbb::parallel_sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

std::string text_of(double number) {
  std::array<char, 32> digits;
  return std::string(decimal(number, digits));
}

// Keeps the ends of a format within the type's numbers.
void stay_finite(ValueFormat& format) {
  if (format.last > 0 && !std::isfinite(format.greatest())) --format.last;
  if (format.last > 0 && !std::isfinite(format.least())) {
    ++format.first;
    --format.last;
  }
}

// The multiples of a step nearest to samples within [least, greatest].
Result<ValueFormat> format_of_step(SampleType type, double step, double least, double greatest) {
  const auto refuse = [&](const std::string& why) { return misuse("a step of " + text_of(step) + " is too fine: " + why); };
  const double first = std::floor(least / step + 0.5), last = std::floor(greatest / step + 0.5);
  if (!(std::fabs(first) <= kMostSteps && std::fabs(last) <= kMostSteps)) return refuse("samples lie more than 2^53 steps from 0");
  if (last - first >= double(std::numeric_limits<ValueKey>::max())) return refuse("the samples span more than 2^32 - 2 steps");
  ValueFormat format{type, step, std::int64_t(first), ValueKey(last - first)};
  stay_finite(format);
  if (!check_value_format(format)) return refuse(std::string("samples of type ") + name_of(type) + " do not distinguish its multiples");
  return format;
}

// A power of two, at least as large as the distance of the type's numbers around the largest value.
double default_step(SampleType type, double least, double greatest) {
  int exponent = 0, largest = 0;
  std::frexp(greatest / 2 - least / 2, &exponent);  // halved: the difference of two doubles can overflow
  std::frexp(std::max(std::fabs(least), std::fabs(greatest)), &largest);
  const int ulp = type == SampleType::f32 ? std::max(largest - 24, -149) : std::max(largest - 53, -1074);
  return std::ldexp(1.0, std::max(exponent - kDefaultBits, ulp));
}

// The numbers of the type f32 from the least sample to the greatest one.
ValueFormat format_of_numbers(double least, double greatest) {
  const auto number = [](double value) {
    const auto size = std::int64_t(std::bit_cast<std::uint32_t>(std::fabs(float(value))));
    return value < 0 ? -size : size;
  };
  return {SampleType::f32, 0, number(least), ValueKey(number(greatest) - number(least))};
}

Result<ValueFormat> exact_format(SampleType type, const SampleSummary& samples) {
  if (type == SampleType::f32) return format_of_numbers(samples.range.least, samples.range.greatest);
  std::vector<double> values = samples.all();
  if (is_float(type)) {
    if (const auto found = find_exact_format(type, values, std::numeric_limits<ValueKey>::max() - 1)) return *found;
  }
  if (values.size() > std::numeric_limits<ValueKey>::max()) return fail("the samples have more than 2^32 - 1 different values, and no exact step");
  return format_of_table(type, std::move(values));
}

}  // namespace

Result<ValueFormat> choose_value_format(SampleType type, const SampleSummary& samples, std::optional<double> step) {
  const auto [least, greatest] = samples.range;
  if (!is_float(type)) {
    if (step && *step != 0 && *step != 1) {
      return misuse(std::string("samples of type ") + name_of(type) + " are stored exactly: the step may be 0 or 1, not " + text_of(*step));
    }
    if (greatest - least >= double(std::numeric_limits<ValueKey>::max())) return exact_format(type, samples);
    return ValueFormat{type, 1, std::int64_t(least), ValueKey(greatest - least)};
  }
  if (step && !(*step >= 0 && std::isfinite(*step))) return misuse("the step is 0 (exact) or a finite number greater than 0, not " + text_of(*step));
  if (step && *step > 0) return format_of_step(type, *step, least, greatest);
  if (const auto values = samples.few(); !values.empty()) {
    if (const auto found = find_exact_format(type, values, ValueKey(kMostExact - 1))) return *found;
  }
  if (step) return exact_format(type, samples);
  return format_of_step(type, default_step(type, least, greatest), least, greatest);
}

Result<ValueFormat> choose_value_format(const Volume& volume, std::optional<double> step) {
  const SampleSummary samples{sample_range(volume), [&] { return few_distinct_samples(volume); }, [&] { return all_distinct_samples(volume); }};
  return choose_value_format(volume.type, samples, step);
}

std::vector<double> few_distinct_samples(const Volume& volume) {
  return visit_samples(volume, []<class T>(std::span<const T> samples) -> std::vector<double> {
    if constexpr (std::is_floating_point_v<T>)
      return few_distinct(samples);
    else
      return {};
  });
}

std::vector<double> all_distinct_samples(const Volume& volume) {
  return visit_samples(volume, [](auto samples) { return all_distinct(samples); });
}

std::vector<ValueKey> keys_of(const Volume& volume, const ValueFormat& format) {
  std::vector<ValueKey> keys(volume.grid.sample_count());
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    tbb::parallel_for(Indices(0, samples.size(), kSamplesAtOnce), [&](const Indices& part) {
      for (std::size_t i = part.begin(); i < part.end(); ++i) keys[i] = key_of_sample(format, samples[i]);
    });
  });
  return keys;
}

void round_samples(Volume& volume, const ValueFormat& format) {
  visit_samples(volume, [&]<class T>(std::span<const T>) {
    if constexpr (!std::is_integral_v<T>) {
      T* const samples = reinterpret_cast<T*>(volume.bytes.data());
      tbb::parallel_for(Indices(0, volume.bytes.size() / sizeof(T), kSamplesAtOnce), [&](const Indices& part) {
        for (std::size_t i = part.begin(); i < part.end(); ++i) samples[i] = T(format.value(format.key(double(samples[i]))));
      });
    }
  });
}

}  // namespace intervale
