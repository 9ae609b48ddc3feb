#include "common/prediction.h"

#include <algorithm>
#include <bit>

namespace intervale {
namespace {

// A centre that lies across the surface from where interpolation puts it lies near: this share of the vertex's distance, as measured on real volumes.
constexpr double kAcross = 0.25;
constexpr double kGuessWeight = 0.05;  // of what a vertex tells whose own distance is a guess

}  // namespace

DiamondContext::CutCount DiamondContext::count_cuts(Side centre) const {
  const std::uint32_t bits = cut_bits(centre);
  return {std::popcount(bits), int((bits & 0x55555) != 0) + int((bits & 0xaaaaa) != 0)};
}

Prediction::Prediction(const DiamondContext& context) : context_(context) {
  measure(0);
  measure(1);
  find_gap();
  side_ = surface_[0].centre < 0 ? Side::below : surface_[1].centre > 0 ? Side::above : Side::inside;
}

// Distances of all vertices from one surface, with the spine's ends as the unit.
void Prediction::measure(int s) {
  const DiamondType& row = *context_.row;
  const int n = row.belt;
  Surface& surface = surface_[s];
  auto& w = surface.distance;
  const bool above0 = above(s, 0), above1 = above(s, 1);
  const auto cut = [&](int e) { return context_.cut[e][s] != 0; };
  if (above0 != above1 && cut(0)) {
    const double t = place(0, s);
    w[0] = t;
    w[1] = 1 - t;
    surface.known = 3;
    surface.centre = above1 ? 0.5 - t : t - 0.5;
    for (int i = 0; i < n; ++i) {
      const int v = 2 + i, end = above(s, v) != above0 ? 0 : 1, e = 1 + end * n + i;
      w[v] = 1;
      if (!cut(e)) continue;
      const double q = place(e, s);
      w[v] = w[end] * (1 - q) / q;
      surface.known |= 1u << v;
    }
    return;
  }
  // Both ends on one side: vertices on the other tell how their distances compare.
  double ratio = 0;
  int ratios = 0;
  for (int i = 0; i < n; ++i) {
    if (above(s, 2 + i) == above0 || !cut(1 + i) || !cut(1 + n + i)) continue;
    const double a = place(1 + i, s), b = place(1 + n + i, s);
    ratio += b / (1 - b) * ((1 - a) / a);
    ++ratios;
  }
  ratio = ratios > 0 ? ratio / ratios : 1;
  const double middle = (1 + ratio) / 2;
  w.fill(middle);
  w[0] = 1;
  w[1] = ratio;
  surface.centre = above0 ? middle : -middle;
  if (ratios == 0) return;
  surface.known = 3;
  for (int i = 0; i < n; ++i) {
    if (above(s, 2 + i) == above0 || !cut(1 + i) || !cut(1 + n + i)) continue;
    const double a = place(1 + i, s), b = place(1 + n + i, s);
    w[2 + i] = ((1 - a) / a + ratio * ((1 - b) / b)) / 2;
    surface.known |= 4u << i;
  }
  // Belt vertices on the spine's side are told by their neighbours in the ring.
  const std::uint32_t across = surface.known;
  for (int i = 0; i < n; ++i) {
    if (above(s, 2 + i) != above0) continue;
    double sum = 0;
    int told = 0;
    for (int k = 0; k < 2; ++k) {
      const int before = i == 0 ? n - 1 : i - 1, e = 1 + 2 * n + (k == 0 ? before : i), neighbour = k == 0 ? before : i + 1 == n ? 0 : i + 1;
      if (!cut(e) || !(across >> (2 + neighbour) & 1)) continue;
      const double q = k == 0 ? 1 - place(e, s) : place(e, s);  // from this vertex
      sum += w[2 + neighbour] * (q / (1 - q));
      ++told;
    }
    if (told == 0) continue;
    w[2 + i] = sum / told;
    surface.known |= 4u << i;
  }
}

// beta - alpha, from the edges that both surfaces cut.
void Prediction::find_gap() {
  const DiamondType& row = *context_.row;
  double sum = 0;
  int told = 0;
  for (int e = 0; e < row.edges; ++e) {
    if (context_.cut[e][0] == 0 || context_.cut[e][1] == 0) continue;
    const auto [a, b] = edge_ends(e, row.belt);
    if (!(surface_[0].known >> a & 1) || !(surface_[0].known >> b & 1)) continue;
    const double apart = place(e, 1) - place(e, 0);
    sum += (apart < 0 ? -apart : apart) * (surface_[0].distance[a] + surface_[0].distance[b]);
    ++told;
  }
  gap_ = told > 0 ? sum / told : 0;
}

// Goes through the cuts of an update in order: code(is_first, prediction) gives the true cut for each, from which the next are predicted.
template <class Code>
void Prediction::walk(Side centre, Code&& code) {
  const DiamondType& row = *context_.row;
  double estimate[2] = {0, 0}, sum[2] = {0, 0}, weight[2] = {0, 0};  // of the centre's distance, from the cuts so far
  const bool centre_above[2] = {centre != Side::below, centre == Side::above};
  for (int v = 0; v < row.vertices; ++v) {
    if (!context_.has(v)) continue;
    const bool both = cut_count(centre, context_.side(v)) == 2;
    double alpha_place = 0;
    for (int s = 0; s < 2; ++s) {
      if (!(s == 0 ? alpha_cuts(centre, context_.side(v)) : beta_cuts(centre, context_.side(v)))) continue;
      Surface& surface = surface_[s];
      const double w = surface.distance[v];
      const bool known = (surface.known >> v & 1) != 0;
      double t = 0;
      if (weight[s] > 0) {
        t = estimate[s] / (estimate[s] + w);
      } else if (s == 1 && weight[0] > 0 && gap_ > 0 && (surface_[0].known >> v & 1)) {
        // Alpha's cuts have told the centre's value and this vertex's; beta lies gap_ above alpha.
        const double from = centre_above[0] ? estimate[0] : -estimate[0];
        const double to = above(0, v) ? surface_[0].distance[v] : -surface_[0].distance[v];
        t = from == to ? 0.5 : (gap_ - from) / (to - from);
      } else {
        const bool as_thought = (surface.centre > 0) == centre_above[s];
        const double m = !as_thought ? kAcross * w : surface.centre < 0 ? -surface.centre : surface.centre;
        t = m / (m + w);
      }
      const auto predicted = std::uint8_t(std::clamp(t * 256, 0.0, 255.0));
      const std::uint8_t q = code(weight[s] == 0, predicted);
      const double place = (q + 0.5) / 256, left = 1 - place;
      double trust = left * left * left * left / (w * w);
      if (!known) trust *= kGuessWeight;
      sum[s] += trust * (w * place / left);
      weight[s] += trust;
      estimate[s] = sum[s] / weight[s];
      if (s == 0) {
        alpha_place = place;
      } else if (both && gap_ == 0) {
        const double apart = place - alpha_place;
        gap_ = (apart < 0 ? -apart : apart) * (estimate[0] + surface_[0].distance[v]);
      }
    }
  }
}

void Prediction::encode(Side centre, std::span<const std::uint8_t> q, std::uint8_t* differences) {
  std::size_t next = 0, first = 0, other = std::size_t(context_.count_cuts(centre).first);
  walk(centre, [&](bool is_first, std::uint8_t predicted) {
    differences[is_first ? first++ : other++] = std::uint8_t(q[next] - predicted);
    return q[next++];
  });
}

void Prediction::decode(Side centre, std::span<const std::uint8_t> differences, std::uint8_t* q) {
  std::size_t next = 0, first = 0, other = std::size_t(context_.count_cuts(centre).first);
  walk(centre, [&](bool is_first, std::uint8_t predicted) {
    q[next] = std::uint8_t(differences[is_first ? first++ : other++] + predicted);
    return q[next++];
  });
}

}  // namespace intervale
