// What a front knows of a diamond before its split: the sides of its vertices.
#pragma once

#include <cstdint>

#include "common/diamond/diamond.h"
#include "common/patch/range.h"

namespace intervale {

inline constexpr int kMaxCuts = 2 * kMaxVertices;  // on the subdivision edges of one diamond

struct DiamondContext {
  const DiamondType* row = nullptr;
  std::uint32_t sides = 0;     // two bits each, by local vertex; 0 for one that does not exist
  std::uint32_t vertices = 0;  // a bit for each local vertex that exists

  [[nodiscard]] Side side(int v) const { return Side(sides >> (2 * v) & 3); }
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
};

}  // namespace intervale
