// marschner-lobb: S. Marschner, R. Lobb, An Evaluation of Reconstruction Filters for Volume Rendering, Visualization
// 1994, section 5.
#include "server/volume/sample_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

namespace intervale {
namespace {

using std::numbers::pi;
using Point = std::array<double, 3>;

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

// sin x cos y + sin y cos z + sin z cos x: the sines and cosines are those of the places, of which there are few.
class Gyroid {
 public:
  explicit Gyroid(const std::vector<double>& places) {
    for (const double place : places) {
      sines_.push_back(std::sin(2 * pi * place));
      cosines_.push_back(std::cos(2 * pi * place));
    }
  }

  void row(std::size_t j, std::size_t k, std::span<double> out) const {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = sines_[i] * cosines_[j] + sines_[j] * cosines_[k] + sines_[k] * cosines_[i];
  }

 private:
  std::vector<double> sines_, cosines_;
};

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

// A Gaussian is a product of three, one an axis, which turns 60 exponentials a sample into 60 multiplications.
class Buckyball {
 public:
  explicit Buckyball(const std::vector<double>& places) : size_(places.size()) {
    constexpr double kRadius = 0.75, kWidth = 0.14;  // of the cage; of an atom, where it has fallen to 1/e
    const auto atoms = carbon_atoms();
    const double scale = kRadius / std::hypot(atoms[0][0], atoms[0][1], atoms[0][2]);
    const auto falloff = [&](double d) { return std::exp(-d * d / (kWidth * kWidth)); };
    for (const auto& atom : atoms)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const double place : places) factors_[axis].push_back(falloff(place - scale * atom[axis]));
    // The field is greatest near an atom, where it is the atom's own 1 and what its three neighbours add, an edge of
    // length 2 away.
    amplitude_ = 255 / (1 + 3 * falloff(2 * scale));
    atoms_ = atoms.size();
  }

  void row(std::size_t j, std::size_t k, std::span<double> out) const {
    constexpr double kNegligible = 1e-9;
    std::fill(out.begin(), out.end(), 0);
    for (std::size_t atom = 0; atom < atoms_; ++atom) {
      const double factor = amplitude_ * factors_[1][atom * size_ + j] * factors_[2][atom * size_ + k];
      if (factor < kNegligible) continue;
      const double* const along = factors_[0].data() + atom * size_;
      for (std::size_t i = 0; i < size_; ++i) out[i] += factor * along[i];
    }
  }

 private:
  std::size_t size_, atoms_ = 0;
  std::array<std::vector<double>, 3> factors_;  // [axis][atom * size + sample]
  double amplitude_ = 0;
};

template <double (*formula)(double, double, double)>
SampleRow rows_by_point(const std::vector<double>& places) {
  return [places](std::size_t j, std::size_t k, std::span<double> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = formula(places[i], places[j], places[k]);
  };
}

// Shared by the copies of the function.
template <class Field>
SampleRow rows_of(const std::vector<double>& places) {
  return [field = std::make_shared<const Field>(places)](std::size_t j, std::size_t k, std::span<double> out) { field->row(j, k, out); };
}

constexpr std::array<SampleFormula, 4> kFormulas{{{"buckyball", 0, 255, rows_of<Buckyball>},
                                                  {"gyroid", -1.5, 1.5, rows_of<Gyroid>},
                                                  {"marschner-lobb", 0, 255, rows_by_point<marschner_lobb>},
                                                  {"hydrogen", 0, 255, rows_by_point<hydrogen>}}};

}  // namespace

std::span<const SampleFormula> sample_formulas() { return kFormulas; }

}  // namespace intervale
