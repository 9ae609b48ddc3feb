// The residuals of updates as bits, in file and on the wire alike.
//
// The models depend only on what both sides know. A server has no mesh, so that is the update itself, its class, and
// what precedes the residual in it.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "common/codec/prediction.h"
#include "common/codec/range_coder.h"

namespace intervale {

struct ResidualCoder {
  // Without models: 2 bits a side and 8 a cut. This bounds what an update takes, however unlike those before it is.
  bool is_plain = false;
  std::array<BitModel, 2> side;
  // By class; whether it is the second surface's, which the first's predicts; whether the centre's side was predicted
  // wrongly; how many cuts.
  std::array<std::array<std::array<std::array<ResidualModel, 5>, 2>, 2>, 3> first;
  // By which one it is, the third standing for all further ones; how many bits the one before has. Small
  // residuals follow small ones.
  std::array<std::array<ResidualModel, 9>, 3> other;

  // The residual of the centre's side, 0 to 2.
  template <class Coder>
  unsigned code_side(Coder& coder, unsigned value = 0) {
    if (is_plain) return coder.raw_bits(2, value);
    if (!coder.bit(side[0], value != 0)) return 0;
    return coder.bit(side[1], value == 2) ? 2 : 1;
  }

  // The residuals of an update's `all` cuts, `firsts` of them the first of their surface; see Prediction::encode.
  // Written from there, or read into there.
  template <class Coder>
  void code_cuts(Coder& coder, int cls, unsigned side_residual, unsigned all, unsigned firsts, std::uint8_t* residuals) {
    if (is_plain) {
      for (unsigned i = 0; i < all; ++i) residuals[i] = std::uint8_t(coder.raw_bits(8, residuals[i]));
      return;
    }
    static constexpr std::array<std::uint8_t, kMaxCuts + 1> kHowMany{0, 0, 1, 2, 2, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4};
    for (unsigned i = 0; i < firsts; ++i) residuals[i] = first[cls][i][side_residual != 0][kHowMany[all]].code(coder, residuals[i]);
    unsigned before = 0;
    for (unsigned i = firsts; i < all; ++i) {
      const std::uint8_t d = residuals[i] = other[std::min(i - firsts, 2u)][before].code(coder, residuals[i]);
      before = std::bit_width(unsigned(d < 128 ? d : 256 - d));
    }
  }
};

}  // namespace intervale
