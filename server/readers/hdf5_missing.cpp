#include "server/readers/hdf5_missing.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "common/patch/visit_samples.h"
#include "server/readers/hdf5_object.h"

namespace intervale {
namespace {

constexpr std::size_t kMostNumbers = 16;

// Calls visit(T()) with the type of the samples.
template <class Visit>
auto visit_type(SampleType type, Visit visit) {
  return visit_samples(Volume{{}, {}, type, {}}, [&]<class T>(std::span<const T>) { return visit(T()); });
}

// Those numbers that a T can be.
template <class T>
std::vector<T> as_stored(std::span<const double> numbers) {
  std::vector<T> stored;
  for (const double number : numbers) {
    if (number >= double(std::numeric_limits<T>::lowest()) && number <= double(std::numeric_limits<T>::max()) &&
        (std::is_floating_point_v<T> || number == std::floor(number)))
      stored.push_back(T(number));
  }
  return stored;
}

template <class T>
T sample_at(std::span<const std::byte> samples, std::size_t i) {
  T sample;
  std::memcpy(&sample, &samples[i * sizeof(T)], sizeof(T));
  return sample;
}

template <class T>
bool contains(std::span<const T> stored, T sample) {
  return std::find(stored.begin(), stored.end(), sample) != stored.end();
}

}  // namespace

namespace {

bool is_in_netcdf(hid_t dataset) {
  const Handle file(H5Iget_file_id(dataset), H5Fclose);
  return file.is_open() && H5Aexists_by_name(file.get(), "/", "_NCProperties", H5P_DEFAULT) > 0;
}

// What an array has where nobody wrote; none if its maker did not say.
std::vector<double> fill_value_of(hid_t dataset) {
  const Handle made(H5Dget_create_plist(dataset), H5Pclose), type(H5Dget_type(dataset), H5Tclose);
  H5D_fill_value_t status = H5D_FILL_VALUE_ERROR;
  if (!made.is_open() || H5Tget_size(type.get()) < 2 || H5Pfill_value_defined(made.get(), &status) < 0 || status != H5D_FILL_VALUE_USER_DEFINED)
    return {};
  double number = 0;
  if (H5Pget_fill_value(made.get(), H5T_NATIVE_DOUBLE, &number) < 0 || !std::isfinite(number)) return {};
  return {number};
}

}  // namespace

MissingNumbers MissingNumbers::of(hid_t dataset) {
  MissingNumbers missing;
  if (H5Aexists(dataset, "_FillValue") <= 0 && is_in_netcdf(dataset)) missing.numbers_ = fill_value_of(dataset);
  for (const char* name : {"_FillValue", "missing_value"}) {
    const auto numbers = numbers_of_attribute(dataset, name, kMostNumbers);
    missing.numbers_.insert(missing.numbers_.end(), numbers.begin(), numbers.end());
  }
  return missing;
}

bool MissingNumbers::are_in(std::span<const std::byte> samples, SampleType type) const {
  return visit_type(type, [&]<class T>(T) {
    const auto stored = as_stored<T>(numbers_);
    for (std::size_t i = 0; i < samples.size() / sizeof(T); ++i) {
      if (contains<T>(stored, sample_at<T>(samples, i))) return true;
    }
    return false;
  });
}

std::vector<std::byte> MissingNumbers::as_nan(std::span<const std::byte> samples, SampleType type, SampleType to, double slope,
                                              double intercept) const {
  std::vector<std::byte> out(samples.size() / size_of(type) * size_of(to));
  const auto convert = [&]<class T, class To>(T, To) {
    const auto stored = as_stored<T>(numbers_);
    for (std::size_t i = 0; i < samples.size() / sizeof(T); ++i) {
      const T sample = sample_at<T>(samples, i);
      To value = To(sample);
      if constexpr (std::is_integral_v<T>) value = To(slope * double(sample) + intercept);
      if (contains<T>(stored, sample)) value = std::numeric_limits<To>::quiet_NaN();
      std::memcpy(&out[i * sizeof(To)], &value, sizeof(To));
    }
  };
  visit_type(type, [&]<class T>(T sample) {
    if (to == SampleType::f32) {
      convert(sample, float());
    } else {
      convert(sample, double());
    }
  });
  return out;
}

SampleType float_type_for(SampleType type, double slope, double intercept) {
  return visit_type(type, [&]<class T>(T) {
    const double low = std::abs(slope * double(std::numeric_limits<T>::lowest()) + intercept);
    const double high = std::abs(slope * double(std::numeric_limits<T>::max()) + intercept), most = std::max(low, high);
    const bool is_enough = sizeof(T) <= 2 && most <= 1e38 && std::abs(slope) >= 1e-20 && most * 0x1p-20 <= std::abs(slope);
    return is_enough ? SampleType::f32 : SampleType::f64;
  });
}

}  // namespace intervale
