#include "server/volume/sample_field.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/mp11/algorithm.hpp>
#include <cassert>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>

#include "server/volume/samples.h"

namespace intervale {
namespace {

std::vector<double> places_of(int size) {
  std::vector<double> places(std::size_t(size), 0);
  for (int i = 0; i < size; ++i) places[std::size_t(i)] = -1 + 2.0 * i / (size - 1);
  return places;
}

template <class T>
T stored_number(double value, const SampleFormula& formula) {
  if constexpr (std::is_floating_point_v<T>) {
    return T(value);
  } else {
    constexpr auto kLeast = std::int64_t(std::numeric_limits<T>::min());
    constexpr auto kSteps = double(std::int64_t(std::numeric_limits<T>::max()) - kLeast);
    const double steps = (value - formula.least) * (kSteps / (formula.greatest - formula.least));
    return T(kLeast + std::int64_t(std::clamp(std::floor(steps + 0.5), 0.0, kSteps)));
  }
}

}  // namespace

Result<SampleField> SampleField::create(std::string_view name, int size, SampleType type) {
  const auto formulas = sample_formulas();
  const auto formula = std::find_if(formulas.begin(), formulas.end(), [name](const SampleFormula& known) { return known.name == name; });
  if (formula == formulas.end()) {
    std::string list;
    for (const auto& known : formulas) list.append(list.empty() ? "" : ", ").append(known.name);
    return misuse("no sample is named '" + std::string(name) + "': choose one of " + list);
  }
  if (size < kMinSampleSize || size > kMaxFieldSize)
    return misuse("a sample of " + std::to_string(size) + " a side cannot be made: --size goes from " + std::to_string(kMinSampleSize) + " to " +
                  std::to_string(kMaxFieldSize));
  return SampleField(*formula, size, type);
}

SampleField::SampleField(const SampleFormula& formula, int size, SampleType type)
    : formula_(&formula), places_(std::size_t(size)), row_(formula.rows(places_of(size))) {
  const double spacing = 2.0 / (size - 1);
  header_ = {std::string(formula.name), {{size, size, size}, Affine::of({spacing, spacing, spacing}, {-1, -1, -1})}, type, {}};
}

void SampleField::fill(std::uint64_t first, std::span<std::byte> out) const {
  const std::size_t count = out.size() / row_bytes();
  assert(out.size() == count * row_bytes() && first + count <= rows() && "whole rows of the volume");
  boost::mp11::mp_with_index<std::tuple_size_v<SampleTypes>>(std::size_t(header_.type), [&](auto type) {
    using T = std::tuple_element_t<type, SampleTypes>;
    const std::span numbers(reinterpret_cast<T*>(out.data()), count * places_);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const tbb::blocked_range<std::size_t>& some) {
      std::vector<double> values(places_);
      for (std::size_t i = some.begin(); i != some.end(); ++i) {
        row_((first + i) % places_, (first + i) / places_, values);
        std::transform(values.begin(), values.end(), numbers.begin() + std::ptrdiff_t(i * places_),
                       [this](double value) { return stored_number<T>(value, *formula_); });
      }
    });
  });
}

}  // namespace intervale
