#include "common/codec/prediction.h"

#include <algorithm>
#include <bit>

#include "common/util/bits.h"

namespace intervale {
namespace {

// The distance of a centre that lies on the other side of the surface than predicted, as a share of the vertex's:
// measured on real volumes.
constexpr double kAcross = 0.125;
constexpr double kGuessVariance = 1e5;  // of a distance that is a guess

// Of a cut q, seen from an edge's first end: the second end's distance over the first's; the variance of that ratio's
// relative error; and 1 / variance. From the other end it is the cut 255 - q.
struct Step {
  double ratio, variance, weight;
};
constexpr std::array<Step, 256> kSteps = [] {
  std::array<Step, 256> steps{};
  for (int q = 0; q < 256; ++q) {
    const double x = (q + 0.5) / 256, y = x * (1 - x);
    steps[q] = {(1 - x) / x, 1 / (y * y), y * y};
  }
  return steps;
}();

constexpr std::uint32_t kAlphaBits = 0x55555, kBetaBits = 0xaaaaa;  // of cut_bits

// Every second bit, the lowest first.
constexpr std::uint32_t even_bits(std::uint32_t v) {
  v &= 0x55555555;
  v = (v | v >> 1) & 0x33333333;
  v = (v | v >> 2) & 0x0f0f0f0f;
  v = (v | v >> 4) & 0x00ff00ff;
  return (v | v >> 8) & 0xffff;
}

}  // namespace

DiamondContext::CutCount DiamondContext::count_cuts(Side centre) const {
  const std::uint32_t bits = cut_bits(centre);
  return {std::popcount(bits), int((bits & kAlphaBits) != 0) + int((bits & kBetaBits) != 0)};
}

Prediction::Prediction(const DiamondContext& context) : context_(context) {
  measure(0);
  measure(1);
  side_ = surface_[0].centre < 0 ? Side::below : surface_[1].centre > 0 ? Side::above : Side::inside;
}

void Prediction::measure(int s) {
  Surface& surface = surface_[s];
  surface.above = even_bits(s == 0 ? context_.sides | context_.sides >> 1 : context_.sides >> 1) & context_.vertices;
  if (surface.above == 0 || surface.above == context_.vertices) {
    surface.centre = surface.above == 0 ? -1 : 1;
    return;
  }
  surface.parts_spine = ((surface.above ^ surface.above >> 1) & 1) != 0;
  if (surface.parts_spine && is_cut(0, s)) {
    measure_from_parted_spine(s);
  } else {
    measure_from_belt(s);
  }
  surface.centre = predict_centre(surface);
}

// The spine's length is the unit; each belt vertex is measured from the spine's end on the other side of the surface.
void Prediction::measure_from_parted_spine(int s) {
  Surface& surface = surface_[s];
  const int n = context_.row->belt;
  const Step& spine = kSteps[step(0, s)];
  const double t = (step(0, s) + 0.5) / 256;
  surface.distance[0] = t;
  surface.distance[1] = 1 - t;
  surface.variance[0] = spine.variance * (1 - t) * (1 - t);
  surface.variance[1] = spine.variance * t * t;
  surface.known = 3;
  const std::uint32_t with_end_0 = (surface.above & 1) != 0 ? surface.above : ~surface.above;
  for (int v = 2; v < n + 2; ++v) {
    const int end = int(with_end_0 >> v & 1), e = end * n + v - 1;
    if (!is_cut(e, s)) continue;
    const Step& cut = kSteps[step(e, s)];
    surface.distance[v] = surface.distance[end] * cut.ratio;
    surface.variance[v] = surface.variance[end] + cut.variance;
    surface.known |= 1u << v;
  }
}

// Adds what a belt vertex's neighbours in the ring say of its distance, those among `which` that lie on the other side
// of the surface.
void Prediction::add_neighbours(int s, int v, std::uint32_t which, Estimate& estimate) const {
  const Surface& surface = surface_[s];
  const int n = context_.row->belt, before = v == 2 ? n + 1 : v - 1, after = v == n + 1 ? 2 : v + 1, first = 2 * n - 1;
  const auto add = [&](int neighbour, const Step& cut) {
    const double weight = 1 / (cut.variance + surface.variance[neighbour]);
    estimate.sum += weight * (surface.distance[neighbour] * cut.ratio);
    estimate.weight += weight;
  };
  if ((which >> before & 1) != 0 && is_cut(first + before, s)) add(before, kSteps[step(first + before, s)]);
  if ((which >> after & 1) != 0 && is_cut(first + v, s)) add(after, kSteps[255 - step(first + v, s)]);
}

// Both ends on one side: belt vertices on the other side give the ratio of the ends' distances, and the distances of
// their neighbours in the ring.
void Prediction::measure_from_belt(int s) {
  Surface& surface = surface_[s];
  const int n = context_.row->belt;
  const std::uint32_t other_side = context_.vertices & ((surface.above & 1) != 0 ? ~surface.above : surface.above);
  std::uint32_t across = 0;
  double ratio = 0, total_weight = 0;
  for (const int v : set_bits(other_side & ~3u)) {
    if (!is_cut(v - 1, s) || !is_cut(n + v - 1, s)) continue;
    const Step &a = kSteps[step(v - 1, s)], &b = kSteps[255 - step(n + v - 1, s)];
    const double weight = a.weight * b.weight / (a.weight + b.weight);
    ratio += weight * (a.ratio * b.ratio);
    total_weight += weight;
    across |= 1u << v;
  }
  if (across == 0) return;
  ratio = ratio / total_weight;
  surface.distance[0] = 1;
  surface.distance[1] = ratio;
  surface.variance[0] = surface.variance[1] = 0.5 / total_weight;
  surface.guess = (1 + ratio) / 2;
  surface.known = across | 3;
  for (const int v : set_bits(across)) {
    const Step &a = kSteps[step(v - 1, s)], &b = kSteps[step(n + v - 1, s)];
    const double both = 1 / (a.weight + b.weight);
    surface.distance[v] = (a.weight * a.ratio + b.weight * (ratio * b.ratio)) * both;
    surface.variance[v] = surface.variance[0] + both;
  }
  const std::uint32_t ring = across >> 2, neighbours = (ring << 1 | ring >> 1 | ring << (n - 1) | ring >> (n - 1)) << 2;
  for (const int v : set_bits(neighbours & context_.vertices & ~other_side & ((4u << n) - 4))) {
    Estimate estimate;
    add_neighbours(s, v, across, estimate);
    if (estimate.weight == 0) continue;
    surface.variance[v] = 1 / estimate.weight;
    surface.distance[v] = estimate.sum * surface.variance[v];
    surface.known |= 1u << v;
  }
}

// The centre's distance, above the surface where positive, from the pairs of vertices that stand opposite each other
// around it. Along an edge of class 0 all pairs are equally far: the belt's mean. In class 1 one pair of the belt is
// the nearest by far. In class 2, pairs at 1 and at sqrt(2): twice the mean of the near ones less that of the far ones
// has no error of second order in the belt's plane. Least squares on real volumes gives these same coefficients, and
// the spine none. Where pairs are missing, half way from the spine's mean to those there are.
double Prediction::predict_centre(const Surface& surface) const {
  if ((surface.known & 3) == 0) return (surface.above & 1) != 0 ? 1 : -1;
  const int n = context_.row->belt, half = n / 2;
  const auto value = [&](int v) { return (surface.above >> v & 1) != 0 ? surface.distance[v] : -surface.distance[v]; };
  const auto sum = [&](int i) { return value(2 + i) + value(2 + i + half); };
  const std::uint32_t ring = surface.known >> 2, pairs = ring & ring >> half & ((1u << half) - 1);
  const double spine = (value(0) + value(1)) / 2;
  double mean = 0;
  switch (n) {
    case 6:
      if (pairs == 7) return (sum(0) + sum(1) + sum(2)) / 6;
      break;
    case 4:
      if ((pairs & 2) != 0) return sum(1) / 2;
      break;
    default:
      if (pairs == 15) return (sum(0) + sum(2)) / 2 - (sum(1) + sum(3)) / 4;
  }
  const std::uint32_t near = n == 8 ? pairs & 5 : pairs;
  if (near == 0) return spine;
  for (const int i : set_bits(near)) mean += sum(i) / 2;
  return (spine + mean / std::popcount(near)) / 2;
}

// A vertex's distance from all that is known around it: where the surface cuts the spine, its neighbours in the ring on
// the other side have been measured from the spine's other end.
Prediction::Measure Prediction::measured(int s, int v) const {
  const Surface& surface = surface_[s];
  if ((surface.known >> v & 1) == 0) return {surface.guess, kGuessVariance};
  if (v < 2 || !surface.parts_spine) return {surface.distance[v], surface.variance[v]};
  Estimate estimate{surface.distance[v] / surface.variance[v], 1 / surface.variance[v]};
  add_neighbours(s, v, surface.known, estimate);
  const double variance = 1 / estimate.weight;
  return {estimate.sum * variance, variance};
}

// beta - alpha, from the edges that both surfaces cut.
void Prediction::find_gap() {
  const DiamondType& row = *context_.row;
  const Surface& alpha = surface_[0];
  // Nothing below, or nothing above: no such edge
  if (alpha.above == context_.vertices || surface_[1].above == 0) return;
  double sum = 0;
  int edges = 0;
  for (int e = 0; e < row.edges; ++e) {
    if ((context_.cut[e][0] & context_.cut[e][1] & 1) == 0) continue;  // places are odd
    const auto [a, b] = edge_ends(e, row.belt);
    if (!(alpha.known >> a & 1) || !(alpha.known >> b & 1)) continue;
    const double apart = (int(context_.cut[e][1]) - int(context_.cut[e][0])) * (1.0 / 512);
    sum += (apart < 0 ? -apart : apart) * (alpha.distance[a] + alpha.distance[b]);
    ++edges;
  }
  if (edges > 0) gap_ = sum / edges;
}

// Visits the cuts of an update in order; bits: which (see cut_bits). code(is_first, prediction) returns the true cut,
// from which the next ones are predicted.
template <class Code>
void Prediction::walk(Side centre, std::uint32_t bits, Code&& code) {
  double sum[2] = {0, 0}, weight[2] = {0, 0};  // of the centre's distance, from the cuts so far
  if ((bits & kAlphaBits) != 0 && (bits & kBetaBits) != 0) find_gap();
  double alpha_place = 0;  // of the last cut of alpha
  for (std::uint32_t left = bits; left != 0; left &= left - 1) {
    const int v = std::countr_zero(left) / 2, s = std::countr_zero(left) & 1;
    const Surface& surface = surface_[s];
    const auto [w, variance] = measured(s, v);
    double t = kAcross / (kAcross + 1);
    if (weight[s] > 0) {
      t = sum[s] / (sum[s] + w * weight[s]);
    } else if (s == 1 && weight[0] > 0 && gap_ >= 0 && (surface_[0].known >> v & 1)) {
      // The centre's value and this vertex's are known from alpha's cuts; beta lies gap_ above alpha.
      const double estimate = sum[0] / weight[0], from = is_above(0, centre) ? estimate : -estimate;
      const double to = (surface_[0].above >> v & 1) != 0 ? surface_[0].distance[v] : -surface_[0].distance[v];
      t = from == to ? 0.5 : (gap_ - from) / (to - from);
    } else if (surface.known != 0 && (surface.centre > 0) == is_above(s, centre)) {
      const double m = surface.centre < 0 ? -surface.centre : surface.centre;
      t = m / (m + w);
    }
    const auto predicted = std::uint8_t(std::clamp(t * 256, 0.0, 255.0));
    const std::uint8_t q = code(weight[s] == 0, predicted);
    if ((left & (left - 1)) == 0) return;  // the last
    const Step& seen = kSteps[255 - q];
    const double estimate = w * seen.ratio, estimate_weight = 1 / ((seen.variance + variance) * (estimate * estimate));
    sum[s] += estimate_weight * estimate;
    weight[s] += estimate_weight;
    if (s == 0) {
      alpha_place = (q + 0.5) / 256;
    } else if ((bits >> (2 * v) & 1) != 0 && gap_ < 0) {
      const double apart = (q + 0.5) / 256 - alpha_place;
      gap_ = (apart < 0 ? -apart : apart) * (sum[0] / weight[0] + measured(0, v).distance);
    }
  }
}

void Prediction::encode(Side centre, std::span<const std::uint8_t> q, std::uint8_t* residuals) {
  const std::uint32_t bits = context_.cut_bits(centre);
  std::size_t next = 0, first = 0, other = std::size_t((bits & kAlphaBits) != 0) + std::size_t((bits & kBetaBits) != 0);
  walk(centre, bits, [&](bool is_first, std::uint8_t predicted) {
    residuals[is_first ? first++ : other++] = std::uint8_t(q[next] - predicted);
    return q[next++];
  });
}

void Prediction::decode(Side centre, std::span<const std::uint8_t> residuals, std::uint8_t* q) {
  const std::uint32_t bits = context_.cut_bits(centre);
  std::size_t next = 0, first = 0, other = std::size_t((bits & kAlphaBits) != 0) + std::size_t((bits & kBetaBits) != 0);
  walk(centre, bits, [&](bool is_first, std::uint8_t predicted) {
    q[next] = std::uint8_t(residuals[is_first ? first++ : other++] + predicted);
    return q[next++];
  });
}

}  // namespace intervale
