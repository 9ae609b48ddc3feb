// An update: what splitting one diamond takes, as residuals of the prediction from the diamond itself.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/codec/prediction.h"

namespace intervale {

// An update as residuals from the prediction of its diamond.
struct UpdateView {
  unsigned side_residual = 0;  // (side - predicted side) modulo 3
  // How many residuals are of the first cut of their surface; those come first
  unsigned first_cuts = 0;
  std::span<const std::uint8_t> residuals;  // of each cut on the subdivision edges, modulo 256; see Prediction::encode
};

// The side and cuts of an update, as Front::split takes them. Nothing if the number of its coefficients does not fit
// its side.
[[nodiscard]] inline std::optional<Side> decode_update(const DiamondContext& context, const UpdateView& update, std::uint8_t* cuts) {
  Prediction prediction(context);
  const Side side = Side((unsigned(prediction.side()) + update.side_residual) % 3);
  const auto count = context.count_cuts(side);
  if (count.all != int(update.residuals.size()) || count.first != int(update.first_cuts)) return {};
  prediction.decode(side, update.residuals, cuts);
  return side;
}

}  // namespace intervale
