// Values of stored numbers, in a type that holds them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

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

// Of those that are no NaN; zeros if all are.
template <class T>
std::pair<T, T> least_and_greatest(std::span<const T> samples) {
  const auto is_number = [](T sample) { return sample == sample; };
  const auto first = std::find_if(samples.begin(), samples.end(), is_number);
  std::pair<T, T> found = first == samples.end() ? std::pair(T(0), T(0)) : std::pair(*first, *first);
  for (const T sample : samples) {
    if (sample < found.first) found.first = sample;
    if (sample > found.second) found.second = sample;
  }
  return found;
}

// Whether f32 keeps values apart that are a stored step apart, by a sixteenth of it. Of stored floats: as they are.
template <class T>
bool is_f32_enough(double slope, double intercept, double most) {
  constexpr double kLeast = 1e-20, kMost = 1e38;  // far from where f32 ends
  if (std::is_same_v<T, float>) return intercept == 0 && most >= kLeast && most <= kMost;
  return sizeof(T) <= 2 && most <= kMost && std::abs(slope) >= kLeast && most * 0x1p-20 <= std::abs(slope);
}

}  // namespace

void rescale(Volume& volume, double slope, double intercept) {
  if (slope == 1 && intercept == 0) return;
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    if (samples.empty()) return;
    const auto [least, greatest] = least_and_greatest(samples);
    const auto [low, high] = std::minmax({slope * double(least) + intercept, slope * double(greatest) + intercept});
    std::optional<SampleType> type;
    if (std::is_integral_v<T> && is_whole(slope) && is_whole(intercept)) type = integer_type(volume.type, low, high);
    if (!type) type = is_f32_enough<T>(slope, intercept, std::max(std::abs(low), std::abs(high))) ? SampleType::f32 : SampleType::f64;
    const Volume shape{{}, {}, *type, {}};
    auto bytes = visit_samples(shape, [&]<class To>(std::span<const To>) { return converted<To>(samples, slope, intercept); });
    volume.type = *type;
    volume.bytes = std::move(bytes);
  });
}

}  // namespace intervale
