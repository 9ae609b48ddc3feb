// An update meets a front: differences become a side and cuts, and the diamond is split.
#pragma once

#include <optional>

#include "common/front.h"
#include "common/interval_volume.h"

namespace intervale {

// Splits one diamond by its update. Nothing, and nothing done, if the update has not as many coefficients as its side calls for; else the cuts of the
// spine, which merging needs back.
[[nodiscard]] inline std::optional<Cuts> apply_update(Front& front, Front::Handle handle, const UpdateView& update) {
  const DiamondContext context = front.context(handle);
  Prediction prediction(context);
  const Side side = Side((unsigned(prediction.side()) + update.side_difference) % 3);
  const auto count = context.count_cuts(side);
  if (count.all != int(update.differences.size()) || count.first != int(update.first_cuts)) return {};
  std::array<std::uint8_t, kMaxCuts> cuts;
  prediction.decode(side, update.differences, cuts.data());
  return front.split(handle, side, std::span(cuts).first(update.differences.size()));
}

}  // namespace intervale
