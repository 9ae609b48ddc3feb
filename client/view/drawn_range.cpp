#include "client/view/drawn_range.h"

#include <utility>

#include "client/view/coarse_front.h"
#include "client/view/point_values.h"

namespace intervale {

DrawnRange::Coarse::Coarse(const StreamClient& client, int levels) : left_out(levels), front(coarse_front(client, levels)), surface(front) {}

void DrawnRange::use_coarse(const StreamClient& client, int levels, const ShownRange& shown) {
  if (!coarse_ || coarse_->left_out != levels) coarse_.emplace(client, levels);
  coarse_->front.set_range(shown.range, shown.refine);
}

BoundarySurface::Change DrawnRange::update(bool all, const std::optional<WantedValues>& wanted) {
  const bool is_other = std::exchange(coarse_is_drawn_, coarse_.has_value()) != coarse_.has_value();
  BoundarySurface& surface = changing();
  BoundarySurface::Change change = all || is_other ? surface.all() : surface.update();
  values_.clear();
  if (wanted) values_ = wanted->channel == nullptr ? point_values(surface) : point_values(surface, *wanted->channel);
  return change;
}

}  // namespace intervale
