// marschner-lobb: S. Marschner, R. Lobb, An Evaluation of Reconstruction Filters for Volume Rendering, Visualization
// 1994, section 5.
#include "server/volume/samples.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace intervale {
namespace {

using std::numbers::pi;
using Point = std::array<double, 3>;

double gyroid(double x, double y, double z) {
  const double u = 2 * pi * x, v = 2 * pi * y, w = 2 * pi * z;
  return std::sin(u) * std::cos(v) + std::sin(v) * std::cos(w) + std::sin(w) * std::cos(u);
}

double marschner_lobb(double x, double y, double z) {
  constexpr double kFrequency = 6, kAlpha = 0.25;
  const double ripple = std::cos(2 * pi * kFrequency * std::cos(pi * std::hypot(x, y) / 2));
  return 255 * (1 - std::sin(pi * z / 2) + kAlpha * (1 + ripple)) / (2 * (1 + kAlpha));
}

// |psi|^2 of n = 3, l = 2, m = 0, unnormalised: (r^2 exp(-r/3) (3 cos^2 - 1))^2 with r in Bohr radii, of which [-1, 1]
// spans 40.
double hydrogen(double x, double y, double z) {
  constexpr double kBohrRadii = 20;
  const double r = kBohrRadii * std::hypot(x, y, z), up = kBohrRadii * z;
  const double wave = std::exp(-r / 3) * (3 * up * up - r * r);
  const double peak = 72 * std::exp(-2.0);  // on the axis at r = 6
  return 255 * (wave / peak) * (wave / peak);
}

// The corners of a truncated icosahedron with edges of length 2: the even permutations of three triples, every sign.
std::vector<Point> carbon_atoms() {
  const double phi = std::numbers::phi;
  const std::array<Point, 3> triples{{{0, 1, 3 * phi}, {1, 2 + phi, 2 * phi}, {phi, 2, 2 * phi + 1}}};
  std::vector<Point> atoms;
  for (const auto& triple : triples)
    for (std::size_t turn = 0; turn < 3; ++turn)
      for (unsigned signs = 0; signs < 8; ++signs) {
        Point atom;
        for (std::size_t axis = 0; axis < 3; ++axis) atom[(axis + turn) % 3] = (signs >> axis & 1U) != 0 ? -triple[axis] : triple[axis];
        if (triple[0] != 0 || (signs & 1U) == 0) atoms.push_back(atom);  // 0 has one sign
      }
  return atoms;
}

std::vector<double> coordinates(int size) {
  std::vector<double> values(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) values[static_cast<std::size_t>(i)] = -1 + 2.0 * i / (size - 1);
  return values;
}

// A Gaussian is a product of three, one an axis, which turns 60 exponentials a sample into 60 multiplications.
class Buckyball {
 public:
  explicit Buckyball(const std::vector<double>& at) : size_(at.size()) {
    constexpr double kRadius = 0.75, kWidth = 0.14;  // of the cage; of an atom, where it has fallen to 1/e
    const auto atoms = carbon_atoms();
    const double scale = kRadius / std::hypot(atoms[0][0], atoms[0][1], atoms[0][2]);
    const auto falloff = [&](double d) { return std::exp(-d * d / (kWidth * kWidth)); };
    for (const auto& atom : atoms)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const double x : at) factors_[axis].push_back(falloff(x - scale * atom[axis]));
    // The field is greatest near an atom, where it is the atom's own 1 and what its three neighbours add, an edge of
    // length 2 away.
    amplitude_ = 255 / (1 + 3 * falloff(2 * scale));
    atoms_ = atoms.size();
  }

  void row(std::size_t j, std::size_t k, std::span<float> out) const {
    constexpr double kNegligible = 1e-9;
    std::vector<double> sums(size_, 0);
    for (std::size_t atom = 0; atom < atoms_; ++atom) {
      const double factor = amplitude_ * factors_[1][atom * size_ + j] * factors_[2][atom * size_ + k];
      if (factor < kNegligible) continue;
      const double* const along = factors_[0].data() + atom * size_;
      for (std::size_t i = 0; i < size_; ++i) sums[i] += factor * along[i];
    }
    for (std::size_t i = 0; i < size_; ++i) out[i] = static_cast<float>(sums[i]);
  }

 private:
  std::size_t size_, atoms_ = 0;
  std::array<std::vector<double>, 3> factors_;  // [axis][atom * size + sample]
  double amplitude_ = 0;
};

// Calls row(j, k, samples along x) for every row, in parallel.
template <class Row>
void fill(Volume& volume, const Row& row) {
  const auto size = static_cast<std::size_t>(volume.grid.dims[0]);
  const std::span samples(reinterpret_cast<float*>(volume.bytes.data()), size * size * size);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size * size), [&](const tbb::blocked_range<std::size_t>& rows) {
    for (auto r = rows.begin(); r != rows.end(); ++r) row(r % size, r / size, samples.subspan(r * size, size));
  });
}

using Formula = double (*)(double, double, double);

void fill(Volume& volume, const std::vector<double>& at, Formula formula) {
  fill(volume, [&](std::size_t j, std::size_t k, std::span<float> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(formula(at[i], at[j], at[k]));
  });
}

constexpr std::array<std::string_view, 4> kNames{"buckyball", "gyroid", "marschner-lobb", "hydrogen"};
constexpr std::array<Formula, 4> kFormulas{nullptr, gyroid, marschner_lobb, hydrogen};  // null: not a formula of one point

}  // namespace

std::span<const std::string_view> sample_names() { return kNames; }

Result<Volume> make_sample(std::string_view name, int size) {
  std::size_t which = 0;
  while (which < kNames.size() && kNames[which] != name) ++which;
  if (which == kNames.size()) {
    std::string list;
    for (const auto known : kNames) list.append(list.empty() ? "" : ", ").append(known);
    return misuse("no sample is named '" + std::string(name) + "': choose one of " + list);
  }
  if (size < kMinSampleSize || size > kMaxSampleSize)
    return misuse("a sample of " + std::to_string(size) + " a side cannot be made: --size goes from " + std::to_string(kMinSampleSize) + " to " +
                  std::to_string(kMaxSampleSize));
  const double spacing = 2.0 / (size - 1);
  Volume volume{std::string(name), {{size, size, size}, Affine::of({spacing, spacing, spacing}, {-1, -1, -1})}, SampleType::f32, {}};
  volume.bytes.resize(volume.grid.sample_count() * sizeof(float));
  const auto at = coordinates(size);
  if (kFormulas[which]) {
    fill(volume, at, kFormulas[which]);
  } else {
    const Buckyball buckyball(at);
    fill(volume, [&](std::size_t j, std::size_t k, std::span<float> out) { buckyball.row(j, k, out); });
  }
  return volume;
}

}  // namespace intervale
