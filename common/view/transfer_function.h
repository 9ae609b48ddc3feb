// Volume rendering: what the values of a field absorb and emit, and the light that reaches the eye along a ray.
//
// Along a ray dI/ds = -kappa(f) I + kappa(f) c(f): light of the colour c is emitted where it is absorbed. See N. Max,
// Optical Models for Direct Volume Rendering, IEEE Transactions on Visualization and Computer Graphics 1(2), 1995.
// The integrals over the values between the two ends of a piece of a ray are differences of sums that are made once: K.
// Engel, M. Kraus and T. Ertl, High-Quality Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel Shading,
// Graphics Hardware 2001. Absorption is exact so; for the order of colours within a piece, long pieces are divided.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "common/util/result.h"

namespace intervale {

// A value, and the opacity of one unit of length (see TransferFunction) that is filled with it: 0 lets all light pass, 1
// none.
struct OpacityPoint {
  double value = 0, opacity = 0;
  friend bool operator==(const OpacityPoint&, const OpacityPoint&) = default;
};
// Linear between its points, of which there is at least one; constant beyond the first and the last. Values ascend.
using OpacityCurve = std::vector<OpacityPoint>;

// Reads "VALUE:OPACITY,VALUE:OPACITY,...". Misuse: what is no finite number, values that do not ascend, opacities outside
// [0, 1], and more than kMaxOpacityPoints. The message names no option.
inline constexpr std::size_t kMaxOpacityPoints = 256;
[[nodiscard]] Result<OpacityCurve> parse_opacity(const std::string& text);

[[nodiscard]] double opacity_at(const OpacityCurve& curve, double value);

// The light of a ray, from the eye on as far as it was followed. Linear, not sRGB.
struct RayLight {
  std::array<float, 3> colour{};  // red, green and blue; emitted, less what was absorbed on its way
  float passes = 1;               // the share of the light from behind that reaches the eye: 1 - opacity
};

// Values are given as places in a span of values: 0 to 1. Lengths are in any one unit. May be used by several threads.
class TransferFunction {
 public:
  struct Optics {
    double opacity = 0;              // of one unit of length, 0 to 1; 1 stands for a little less, that absorption is finite
    std::array<double, 3> colour{};  // linear
  };
  // Calls optics_of() for kCells + 1 places at equal distances; in between, absorption and emission are linear.
  explicit TransferFunction(const std::function<Optics(double place)>& optics_of);

  // Follows a ray on for `length`, where the value changes linearly. from, to: places, 0 to 1. length: at least 0.
  void add(RayLight& light, double from, double to, double length) const;

 private:
  static constexpr std::size_t kCells = 1024;
  using Rates = std::array<double, 4>;  // absorption, and the emission of each colour, for one unit of length
  struct Node {
    Rates rates{};
    Rates sum{};  // the integral of the rates over the places from 0 to here
  };
  [[nodiscard]] Rates mean_of(double from, double to) const;
  [[nodiscard]] Rates sum_to(double place) const;

  std::vector<Node> nodes_;
};

}  // namespace intervale
