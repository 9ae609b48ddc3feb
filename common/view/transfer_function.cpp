#include "common/view/transfer_function.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace intervale {
namespace {

constexpr double kMostOpacity = 1 - 1e-6;  // absorption is 13.8 then
constexpr double kDepthOfPiece = 0.25;     // optical depth; colours that change by d within a piece are off by d / 48 of its light
constexpr double kPlacesOfPiece = 256;     // no piece is shorter than this part of all places
constexpr float kDark = 1e-5F;             // what passes then cannot be seen

// All of a text as a finite number.
bool read_number(const std::string& text, double& number) {
  char* end = nullptr;
  number = std::strtod(text.c_str(), &end);
  return !text.empty() && end == text.c_str() + text.size() && std::isfinite(number);
}

}  // namespace

Result<OpacityCurve> parse_opacity(const std::string& text) {
  OpacityCurve curve;
  for (std::size_t first = 0; first <= text.size();) {
    const std::size_t last = std::min(text.find(',', first), text.size());
    const std::string point = text.substr(first, last - first);
    const std::size_t colon = point.find(':');
    OpacityPoint read;
    if (colon == std::string::npos || !read_number(point.substr(0, colon), read.value) || !read_number(point.substr(colon + 1), read.opacity))
      return misuse("'" + point + "' is not VALUE:OPACITY, two finite numbers");
    if (read.opacity < 0 || read.opacity > 1) return misuse("the opacity in '" + point + "' is not within 0 and 1");
    if (!curve.empty() && !(curve.back().value < read.value)) return misuse("values must ascend, which that of '" + point + "' does not");
    if (curve.size() == kMaxOpacityPoints) return misuse("there are more than " + std::to_string(kMaxOpacityPoints) + " values");
    curve.push_back(read);
    first = last + 1;
  }
  return curve;
}

double opacity_at(const OpacityCurve& curve, double value) {
  const auto after = std::find_if(curve.begin(), curve.end(), [value](const OpacityPoint& point) { return point.value > value; });
  if (after == curve.begin()) return after->opacity;
  const OpacityPoint& low = *(after - 1);
  if (after == curve.end()) return low.opacity;
  // Halved: differences of doubles can overflow.
  const double t = (value / 2 - low.value / 2) / (after->value / 2 - low.value / 2);
  return low.opacity + t * (after->opacity - low.opacity);
}

TransferFunction::TransferFunction(const std::function<Optics(double place)>& optics_of) : nodes_(kCells + 1) {
  for (std::size_t i = 0; i <= kCells; ++i) {
    const Optics optics = optics_of(double(i) / kCells);
    Node& node = nodes_[i];
    node.rates[0] = -std::log1p(-std::min(optics.opacity, kMostOpacity));
    for (std::size_t k = 0; k < 3; ++k) node.rates[k + 1] = node.rates[0] * optics.colour[k];
    for (std::size_t k = 0; k < 4 && i > 0; ++k) node.sum[k] = nodes_[i - 1].sum[k] + (nodes_[i - 1].rates[k] + node.rates[k]) / (2 * kCells);
  }
}

TransferFunction::Rates TransferFunction::sum_to(double place) const {
  const std::size_t cell = std::min(std::size_t(place * kCells), kCells - 1);
  const double t = place * kCells - double(cell);
  const Node &low = nodes_[cell], &high = nodes_[cell + 1];
  Rates sum;
  for (std::size_t k = 0; k < 4; ++k) sum[k] = low.sum[k] + t * (low.rates[k] + t / 2 * (high.rates[k] - low.rates[k])) / kCells;
  return sum;
}

TransferFunction::Rates TransferFunction::mean_of(double from, double to) const {
  const std::size_t cell = std::min(std::size_t(from * kCells), kCells - 1);
  Rates mean;
  if (cell == std::min(std::size_t(to * kCells), kCells - 1)) {  // linear there
    const double t = (from + to) / 2 * kCells - double(cell);
    for (std::size_t k = 0; k < 4; ++k) mean[k] = nodes_[cell].rates[k] + t * (nodes_[cell + 1].rates[k] - nodes_[cell].rates[k]);
    return mean;
  }
  const Rates low = sum_to(from), high = sum_to(to);
  for (std::size_t k = 0; k < 4; ++k) mean[k] = (high[k] - low[k]) / (to - from);
  return mean;
}

void TransferFunction::add(RayLight& light, double from, double to, double length) const {
  const auto follow = [&light](const Rates& mean, double along) {
    if (!(mean[0] > 0)) return;
    const double absorbed = -std::expm1(-mean[0] * along), share = light.passes * absorbed / mean[0];
    for (std::size_t k = 0; k < 3; ++k) light.colour[k] += float(share * mean[k + 1]);
    light.passes = float(light.passes * (1 - absorbed));
  };
  const Rates mean = mean_of(from, to);
  const double pieces = std::ceil(std::min(mean[0] * length / kDepthOfPiece, std::abs(to - from) * kPlacesOfPiece));
  if (!(pieces > 1)) return follow(mean, length);
  for (double i = 0; i < pieces && light.passes > kDark; ++i) {
    const double begin = from + (to - from) * (i / pieces), end = from + (to - from) * ((i + 1) / pieces);
    follow(mean_of(begin, end), length / pieces);
  }
}

}  // namespace intervale
