#include "client/view/stand_in.h"

#include <algorithm>
#include <cmath>

#include "client/view/coarse_front.h"

namespace intervale {
namespace {

constexpr int kAllLevels = 3 * 24;  // more than any grid has

// How many levels to leave out so that of `now` triangles about `most` are left: three levels are a scale, which leaves
// a quarter of a surface.
int levels_for(std::uint64_t now, std::uint64_t most) {
  if (now <= most) return 0;
  return std::max(1, int(std::floor(1.5 * std::log2(double(now) / double(std::max<std::uint64_t>(1, most))))));
}

}  // namespace

StandIn::StandIn(const StreamClient& client, std::uint64_t full, std::uint64_t most) {
  int levels = levels_for(full, most);
  for (make(client, levels); triangles() > most && levels < kAllLevels; make(client, levels)) levels += levels_for(triangles(), most);
}

std::uint64_t StandIn::triangles() const {
  std::uint64_t sum = 0;
  for (const DrawnRange& range : ranges_) sum += range.surface().triangles();
  return sum;
}

void StandIn::make(const StreamClient& client, int levels) {
  ranges_.clear();
  fronts_.clear();
  for (const Front& front : client.fronts()) ranges_.emplace_back(fronts_.emplace_back(coarse_shown_front(client, front, levels)));
  for (DrawnRange& range : ranges_) (void)range.update(true, {});
}

}  // namespace intervale
