// Predicts a diamond's split from what is around it: the side of its centre, and the cuts on the subdivision edges.
//
// All cuts of one surface around one diamond depend on the same few values. A cut at the fraction t of an edge means
// that the field's distances from the surface's value at the edge's ends are as t to 1 - t. Along the spine and the
// edges around it that gives the vertices' distances in one unit, and these predict the centre's: its side, and the
// first cut. Where a diamond's vertices stand around its centre in pairs, the nearest pairs, or pairs at two distances,
// predict the centre better than the spine does. The first cut in turn determines the centre's true distance, and so
// the other cuts, up to their rounding. Where alpha and beta both cut one edge, that is beta - alpha in the same unit,
// and alpha's cuts predict beta's.
//
// An update therefore keeps the residuals of the prediction, which are small. A prediction reads nothing but the
// diamond, so residuals are computed once and are right in whatever order updates arrive. Arithmetic is plain double
// precision in a fixed order: every machine predicts alike.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/diamond/diamond.h"
#include "common/patch/range.h"

namespace intervale {

inline constexpr int kMaxCuts = 2 * kMaxVertices;  // on the subdivision edges of one diamond

// An unsplit diamond, as its front or its field know it.
struct DiamondContext {
  const DiamondType* row = nullptr;
  std::uint32_t sides = 0;     // two bits each, by local vertex; 0 for one that does not exist
  std::uint32_t vertices = 0;  // a bit for each local vertex that exists
  // Of each edge, by surface (0 alpha, 1 beta): 2 q + 1, the cut's place from the first of edge_ends in 1/512; 0 where
  // there is none.
  std::array<std::array<std::uint16_t, 2>, kMaxEdges> cut{};

  [[nodiscard]] Side side(int v) const { return Side(sides >> (2 * v) & 3); }
  [[nodiscard]] bool has(int v) const { return (vertices >> v & 1) != 0; }
  // The vertices that exist, with a pair of bits each as in sides: 01.
  [[nodiscard]] std::uint32_t pairs() const {
    std::uint32_t exists = vertices;
    exists = (exists | exists << 8) & 0x300ff;
    exists = (exists | exists << 4) & 0x30f0f;
    exists = (exists | exists << 2) & 0x33333;
    return (exists | exists << 1) & 0x55555;
  }

  // Which subdivision edges are cut if the centre lies there: bit 2 v by alpha and bit 2 v + 1 by beta on the edge to
  // local vertex v.
  [[nodiscard]] std::uint32_t cut_bits(Side centre) const {
    const std::uint32_t exists = pairs(), inside = sides & exists, above = sides >> 1 & exists, below = exists & ~(inside | above);
    const std::uint32_t alpha = centre == Side::below ? inside | above : below, beta = centre == Side::above ? inside | below : above;
    return alpha | beta << 1;
  }

  // Whether vertices lie on different sides: such a diamond is relevant.
  [[nodiscard]] bool is_mixed() const { return sides != 0 && sides != pairs() && sides != pairs() << 1; }

  // How many cuts there are on the subdivision edges if the centre lies there, and how many of them are the first of
  // their surface.
  struct CutCount {
    int all = 0, first = 0;
  };
  [[nodiscard]] CutCount count_cuts(Side centre) const;
};

class Prediction {
 public:
  explicit Prediction(const DiamondContext& context);  // which must outlive it

  [[nodiscard]] Side side() const { return side_; }

  // Residuals of the cuts q from their prediction, modulo 256, and back; count_cuts(centre).all of them. Cuts in order
  // of local vertices, alpha before beta; residuals with each surface's first cut before all others, for its prediction
  // is further off than theirs. Once only.
  void encode(Side centre, std::span<const std::uint8_t> q, std::uint8_t* residuals);
  void decode(Side centre, std::span<const std::uint8_t> residuals, std::uint8_t* q);

 private:
  // Distances of the field from one surface's value, in a unit of the surface's own.
  struct Surface {
    std::uint32_t above = 0;  // a bit for each vertex
    // A bit for each vertex with a known distance; none where the surface does not cut the diamond
    std::uint32_t known = 0;
    bool parts_spine = false;                   // the spine's ends lie on different sides
    std::array<double, kMaxVertices> distance;  // of each vertex known
    // Of each vertex known: of the distance's relative error, in steps of 1/256
    std::array<double, kMaxVertices> variance;
    double guess = 1;   // the distance of all others
    double centre = 0;  // of the centre: above the value where positive
  };
  // A distance, and the variance of its relative error.
  struct Measure {
    double distance, variance;
  };
  // Several estimates of one distance: the sum of each one's weight times the estimate, and the sum of the weights.
  struct Estimate {
    double sum = 0, weight = 0;
  };
  [[nodiscard]] bool is_above(int s, Side centre) const { return s == 0 ? centre != Side::below : centre == Side::above; }
  [[nodiscard]] bool is_cut(int edge, int s) const { return context_.cut[edge][s] != 0; }
  [[nodiscard]] unsigned step(int edge, int s) const { return context_.cut[edge][s] / 2u; }
  void measure(int s);
  void measure_from_parted_spine(int s);
  void measure_from_belt(int s);
  void add_neighbours(int s, int v, std::uint32_t which, Estimate& estimate) const;
  [[nodiscard]] double predict_centre(const Surface& surface) const;
  [[nodiscard]] Measure measured(int s, int v) const;
  void find_gap();
  template <class Code>
  void walk(Side centre, std::uint32_t bits, Code&& code);

  const DiamondContext& context_;
  std::array<Surface, 2> surface_;
  double gap_ = -1;  // beta - alpha in alpha's unit; less than 0 where it is not known
  Side side_ = Side::below;
};

}  // namespace intervale
