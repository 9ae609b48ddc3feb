// Splits a diamond of a front by an update.
#pragma once

#include <array>
#include <span>

#include "common/codec/update.h"
#include "common/front/front.h"

namespace intervale {

// Splits one diamond by its update. False, and nothing done, if the number of the update's coefficients does not fit
// its side.
[[nodiscard]] inline bool apply_update(Front& front, Front::Handle handle, const UpdateView& update) {
  const DiamondContext context = front.context(handle);
  std::array<std::uint8_t, kMaxCuts> cuts;
  const auto side = decode_update(context, update, cuts.data());
  if (side) front.split(handle, *side, std::span(cuts).first(update.residuals.size()));
  return side.has_value();
}

}  // namespace intervale
