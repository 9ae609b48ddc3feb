// Values of stored numbers, in a type that holds them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "common/patch/visit_samples.h"
#include "server/volume/volume_header.h"

namespace intervale {
namespace {

// The numbers of a volume in another type. They fit.
template <class To, class From>
std::vector<std::byte> converted(std::span<const From> from, double slope, double intercept) {
  std::vector<std::byte> bytes(from.size() * sizeof(To));
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto value = To(slope * double(from[i]) + intercept);
    std::memcpy(&bytes[i * sizeof(To)], &value, sizeof value);
  }
  return bytes;
}

bool is_whole(double value) { return std::abs(value) <= 1e9 && value == std::floor(value); }

// Of the types that hold all integers from `least` to `greatest` the first: `type` itself, then from narrow to wide.
std::optional<SampleType> integer_type(SampleType type, double least, double greatest) {
  for (const SampleType candidate : {type, SampleType::u8, SampleType::i8, SampleType::u16, SampleType::i16, SampleType::u32, SampleType::i32}) {
    const Volume shape{{}, {}, candidate, {}};
    const bool fits = visit_samples(shape, [&]<class T>(std::span<const T>) {
      return least >= double(std::numeric_limits<T>::lowest()) && greatest <= double(std::numeric_limits<T>::max());
    });
    if (fits) return candidate;
  }
  return {};
}

// Whether f32 keeps values apart that are a stored step apart, by a sixteenth of it. Of stored floats: as they are.
template <class T>
bool is_f32_enough(double slope, double intercept, double most) {
  constexpr double kLeast = 1e-20, kMost = 1e38;  // far from where f32 ends
  if (std::is_same_v<T, float>) return intercept == 0 && most >= kLeast && most <= kMost;
  return sizeof(T) <= 2 && most <= kMost && std::abs(slope) >= kLeast && most * 0x1p-20 <= std::abs(slope);
}

}  // namespace

void StoredRange::add(const Volume& volume) {
  visit_samples(volume, [this]<class T>(std::span<const T> samples) {
    for (const T sample : samples) {
      if (double(sample) < least) least = double(sample);
      if (double(sample) > greatest) greatest = double(sample);
    }
  });
}

SampleType rescaled_type(SampleType stored, const StoredRange& range, double slope, double intercept) {
  if (slope == 1 && intercept == 0) return stored;
  const bool is_any = range.least <= range.greatest;  // not so if all are NaN
  const auto [low, high] = std::minmax({slope * (is_any ? range.least : 0) + intercept, slope * (is_any ? range.greatest : 0) + intercept});
  if (!is_float(stored) && is_whole(slope) && is_whole(intercept)) {
    if (const auto type = integer_type(stored, low, high)) return *type;
  }
  const double most = std::max(std::abs(low), std::abs(high));
  const bool is_enough = visit_samples(stored, {}, [&]<class T>(std::span<const T>) { return is_f32_enough<T>(slope, intercept, most); });
  return is_enough ? SampleType::f32 : SampleType::f64;
}

void rescale(Volume& volume, double slope, double intercept, SampleType to) {
  if (slope == 1 && intercept == 0) return;
  volume.bytes = visit_samples(volume, [&](auto samples) {
    return visit_samples(to, {}, [&]<class To>(std::span<const To>) { return converted<To>(samples, slope, intercept); });
  });
  volume.type = to;
}

void rescale(Volume& volume, double slope, double intercept) {
  if (slope == 1 && intercept == 0) return;
  StoredRange range;
  range.add(volume);
  rescale(volume, slope, intercept, rescaled_type(volume.type, range, slope, intercept));
}

}  // namespace intervale
