#include "server/readers/hdf5_axes.h"

#include <hdf5_hl.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "common/patch/labels.h"
#include "server/readers/hdf5_object.h"

namespace intervale {
namespace {

// Coordinates along an axis, evenly spaced.
struct Axis {
  double first = 0, step = 1;
  std::string unit;
};

std::string name_of_object(hid_t object) {
  std::string name(200, '\0');
  const auto length = H5Iget_name(object, name.data(), name.size());
  name.resize(std::size_t(std::clamp<decltype(length)>(length, 0, std::ssize(name) - 1)));
  return name;
}

// Where the step differs most from the usual one. at: three coordinates at least.
std::string uneven_step(const std::vector<double>& at) {
  std::vector<double> steps(at.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double step = at[i + 1] - at[i];
    steps[i] = std::isfinite(step) ? step : std::numeric_limits<double>::max();  // so that they have an order
  }
  auto sorted = steps;
  const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double usual = *middle;
  const auto worst = std::max_element(steps.begin(), steps.end(), [usual](double a, double b) { return std::abs(a - usual) < std::abs(b - usual); });
  const auto i = std::size_t(worst - steps.begin());
  std::array<char, 100> numbers{};
  std::snprintf(numbers.data(), numbers.size(), "from %g to %g, where the usual step is %g", at[i], at[i + 1], usual);
  return "from index " + std::to_string(i) + " to " + std::to_string(i + 1) + " it goes " + numbers.data();
}

// Those of a coordinate variable. None if it is no variable of numbers for the axis, or has no numbers: NetCDF makes such
// ones of dimensions.
Result<std::optional<Axis>> axis_of(hid_t scale, hsize_t count, const std::string& where) {
  constexpr double kEven = 1e-3;  // of a step
  std::optional<Axis> none;
  if (dims_of(scale) != std::vector{count} || !is_in_file(scale)) return none;
  const Handle type(H5Dget_type(scale), H5Tclose);
  std::vector<double> at(count);
  if (H5Dread(scale, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, at.data()) < 0) return none;
  const double step = (at.back() - at.front()) / double(count - 1);
  if (std::all_of(at.begin(), at.end(), [&](double x) { return x == at.front(); })) return none;
  const bool is_single = H5Tget_class(type.get()) == H5T_FLOAT && H5Tget_size(type.get()) <= sizeof(float);
  const double rounding = std::max(std::abs(at.front()), std::abs(at.back())) * (is_single ? 0x1p-22 : 0x1p-50);
  bool is_even = std::isfinite(at.front()) && std::isfinite(step) && step != 0;
  for (hsize_t i = 0; is_even && i < count; ++i) is_even = std::abs(at[i] - (at.front() + step * double(i))) <= kEven * std::abs(step) + rounding;
  if (!is_even)
    return fail(where + ": the coordinate variable '" + name_of_object(scale) + "' is not evenly spaced: " + uneven_step(at) +
                "; bring the array to even steps first");
  return std::optional(Axis{at.front(), step, text_of_attribute(scale, "units")});
}

}  // namespace

Result<Hdf5Places> places_of(hid_t dataset, const std::array<hsize_t, 3>& zyx, const std::string& where) {
  const auto size = numbers_of_attribute(dataset, "element_size_um", 3);
  if (size.size() == 3 && std::all_of(size.begin(), size.end(), [](double s) { return s > 0; }))
    return Hdf5Places{Affine::of({size[2], size[1], size[0]}), "\u00b5m"};
  std::array<Axis, 3> axes;
  struct Search {
    hsize_t count;
    const std::string& where;
    Result<std::optional<Axis>> found;
  };
  const auto take = [](hid_t, unsigned, hid_t scale, void* to) -> herr_t {
    auto& search = *static_cast<Search*>(to);
    search.found = axis_of(scale, search.count, search.where);
    return !search.found || *search.found ? 1 : 0;
  };
  const std::size_t rank = dims_of(dataset).size();
  for (std::size_t k = 0; k < 3; ++k) {
    Search search{zyx[2 - k], where, std::optional<Axis>()};
    H5DSiterate_scales(dataset, unsigned(rank - 1 - k), nullptr, take, &search);
    if (!search.found) return tl::unexpected<Error>(search.found.error());
    if (*search.found) axes[k] = **search.found;
  }
  Hdf5Places places{Affine::of({axes[0].step, axes[1].step, axes[2].step}, {axes[0].first, axes[1].first, axes[2].first}), {}};
  if (axes[0].unit == axes[1].unit && axes[0].unit == axes[2].unit && is_label(axes[0].unit)) places.unit = axes[0].unit;
  return places;
}

}  // namespace intervale
