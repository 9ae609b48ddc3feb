// An update meets a front: differences become a side and cuts, and the diamond is split.
#pragma once

#include <optional>

#include "common/front.h"
#include "common/interval_volume.h"

namespace intervale {

// The side and cuts of an update, as Front::split takes them. Nothing if it has not as many coefficients as its side calls for.
[[nodiscard]] inline std::optional<Side> decode_update(const DiamondContext& context, const UpdateView& update, std::uint8_t* cuts) {
  Prediction prediction(context);
  const Side side = Side((unsigned(prediction.side()) + update.side_difference) % 3);
  const auto count = context.count_cuts(side);
  if (count.all != int(update.differences.size()) || count.first != int(update.first_cuts)) return {};
  prediction.decode(side, update.differences, cuts);
  return side;
}

// Splits one diamond by its update. False, and nothing done, if the update has not as many coefficients as its side calls for.
[[nodiscard]] inline bool apply_update(Front& front, Front::Handle handle, const UpdateView& update) {
  const DiamondContext context = front.context(handle);
  std::array<std::uint8_t, kMaxCuts> cuts;
  const auto side = decode_update(context, update, cuts.data());
  if (side) front.split(handle, *side, std::span(cuts).first(update.differences.size()));
  return side.has_value();
}

}  // namespace intervale
