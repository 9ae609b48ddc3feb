#include "server/builder/volume_positions.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/patch/visit_samples.h"
#include "server/builder/cell_tets.h"

namespace intervale {
namespace {

// The n-th point of a sequence that fills a tetrahedron evenly, as barycentric coordinates: three coordinates of a
// lattice of rank 1, in ascending order, divide [0, 1] into four parts. (Martin Roberts, The Unreasonable Effectiveness
// of Quasirandom Sequences, 2018; Luc Devroye, Non-Uniform Random Variate Generation, 1986, section V.2.)
std::array<double, 4> point_in_tet(std::size_t n) {
  constexpr std::array<double, 3> kSteps{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  std::array<double, 3> u{};
  for (int k = 0; k < 3; ++k) {
    const double whole = kSteps[k] * double(n + 1);
    u[k] = whole - std::floor(whole);
  }
  if (u[0] > u[1]) std::swap(u[0], u[1]);
  if (u[1] > u[2]) std::swap(u[1], u[2]);
  if (u[0] > u[1]) std::swap(u[0], u[1]);
  return {u[0], u[1] - u[0], u[2] - u[1], 1 - u[2]};
}

// A number that looks random.
std::uint64_t mixed(std::uint64_t x) {  // the finaliser of SplitMix64
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
  x = (x ^ x >> 27) * 0x94d049bb133111eb;
  return x ^ x >> 31;
}

// Values of F at points that are spread evenly over the box, at least `count`; wanted: in which cells.
template <class T>
std::vector<double> values_at_points(std::span<const T> samples, const std::array<std::int32_t, 3>& dims, std::size_t count,
                                     const CellFilter& wanted) {
  const std::array<std::uint64_t, 3> cells{std::uint64_t(dims[0] - 1), std::uint64_t(dims[1] - 1), std::uint64_t(dims[2] - 1)};
  const std::uint64_t all = cells[0] * cells[1] * cells[2] * kCellTets.size(), some = std::min<std::uint64_t>(all, count);
  const std::size_t each = (count + some - 1) / some;  // points in a tetrahedron
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<double> values(some * each, kNone);
  tbb::parallel_for(std::uint64_t(0), some, [&](std::uint64_t i) {
    // Any one of the i-th of `some` equal parts of all tetrahedra.
    const auto begin = std::uint64_t(double(all) * double(i) / double(some)), end = std::uint64_t(double(all) * double(i + 1) / double(some));
    const std::uint64_t number = std::min(all - 1, begin + (end > begin ? mixed(i) % (end - begin) : 0)), cell = number / kCellTets.size();
    const Vertex first{std::int32_t(cell % cells[0]), std::int32_t(cell / cells[0] % cells[1]), std::int32_t(cell / cells[0] / cells[1])};
    if (wanted && !wanted(first)) return;
    const std::ptrdiff_t row = dims[0], slice = row * dims[1];
    const auto corners = cell_corners(first, row, slice);
    const T* const start = &samples[std::size_t(first.x + first.y * row + first.z * slice)];
    std::array<double, 4> f{};
    for (int k = 0; k < 4; ++k) f[k] = double(start[corners[kCellTets[number % kCellTets.size()][k]]]);
    const bool constant = f[0] == f[1] && f[0] == f[2] && f[0] == f[3];
    for (std::size_t n = i * each; n < (i + 1) * each; ++n) {
      const auto w = point_in_tet(n);
      values[n] = constant ? f[0] : w[0] * f[0] + w[1] * f[1] + w[2] * f[2] + w[3] * f[3];
    }
  });
  if (wanted) std::erase(values, kNone);
  return values;
}

// The distribution of these values, which ascend and lie within [least, greatest] up to rounding.
std::vector<DistributionPoint> distribution_of(const std::vector<double>& values, double least, double greatest) {
  const double unit = 1 / double(values.size());
  std::vector<DistributionPoint> points{{least, 0, 0}};
  for (std::size_t i = 0; i < values.size();) {
    const double value = std::clamp(values[i], least, greatest);
    const std::size_t begin = i;
    while (i < values.size() && std::min(values[i], greatest) <= value) ++i;
    if (value > points.back().value) points.push_back({value, double(begin) * unit, 0});
    points.back().not_above = double(i) * unit;
  }
  if (greatest > points.back().value) points.push_back({greatest, 1, 1});
  return points;
}

// The slopes of the lines from a point that pass others within a tolerance.
class Cone {
 public:
  Cone(const DistributionPoint& apex, double tolerance) : apex_(apex), tolerance_(tolerance) {}
  [[nodiscard]] bool contains(const DistributionPoint& p) const {
    const double slope = (p.below - apex_.not_above) / along(p);
    return flattest_ <= slope && slope <= steepest_;
  }
  void narrow(const DistributionPoint& p) {
    flattest_ = std::max(flattest_, (p.not_above - tolerance_ - apex_.not_above) / along(p));
    steepest_ = std::min(steepest_, (p.below + tolerance_ - apex_.not_above) / along(p));
  }

 private:
  // Halved: the difference of two doubles can overflow.
  [[nodiscard]] double along(const DistributionPoint& p) const { return p.value / 2 - apex_.value / 2; }
  DistributionPoint apex_;
  double tolerance_, flattest_ = -std::numeric_limits<double>::infinity(), steepest_ = std::numeric_limits<double>::infinity();
};

}  // namespace

// Joseph O'Rourke, An on-line algorithm for fitting straight lines between data ranges, 1981. Here lines begin and end
// on the distribution; each ends at the last point that it can reach before the first one that it cannot.
std::vector<DistributionPoint> estimate_volumes(std::vector<double> values, double least, double greatest, double tolerance) {
  tbb::parallel_sort(values.begin(), values.end());
  const std::vector<DistributionPoint> points = distribution_of(values, least, greatest);
  std::vector<DistributionPoint> chosen{points[0]};
  Cone cone(points[0], tolerance);
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (!cone.contains(points[i])) {
      chosen.push_back(points[i - 1]);
      cone = Cone(points[i - 1], tolerance);
    }
    cone.narrow(points[i]);
  }
  if (points.size() > 1) chosen.push_back(points.back());
  return chosen;
}

std::vector<double> values_in_cells(const SampleView& view, std::size_t count, const CellFilter& wanted) {
  return visit_samples(view.type, view.bytes, [&](auto samples) { return values_at_points(samples, view.dims, count, wanted); });
}

}  // namespace intervale
