#include "client/view/point_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/util/bits.h"

namespace intervale {
namespace {

float rounded(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return float(std::clamp(value, -kMost, kMost));
}

}  // namespace

std::vector<float> point_values(const BoundarySurface& surface) {
  const FrontState& front = surface.mesher().state();
  const float alpha = rounded(front.values.range.alpha), beta = rounded(front.values.range.beta);
  std::vector<float> values(front.points);
  for (PointId id = 0; id < front.points; ++id) values[id] = surface.surface(id) == Surface::alpha ? alpha : beta;
  // A centre in the range is a point.
  const auto place_centre = [&](const FrontState::Block& block, Slot slot) {
    values[block.split_at(slot).centre()] = rounded(front.values.format.value(block.key[slot]));
  };
  if (front.origin.side(Slot()) == Side::inside) place_centre(front.origin, Slot());
  for (const FrontState::Block& block : front.blocks) {
    for (const Slot slot : set_bits<Slot>(block.shown & block.inside)) place_centre(block, slot);
  }
  return values;
}

std::vector<float> point_values(const BoundarySurface& surface, const ChannelValues& channel) {
  const FrontMesher& mesher = surface.mesher();
  const MeshChannel source = channel.for_mesh();
  const double least = channel.channel().components.front().format.least();
  std::array<double, kMaxComponents> components{};
  const std::span<double> here = std::span(components).first(source.components);
  std::vector<float> values(mesher.state().points);
  std::vector<FrontMesher::Point> points;
  std::vector<FrontMesher::Ends> ends;
  for (std::size_t number = 0; number < mesher.state().blocks.size(); ++number) {
    if (mesher.block(number).shown == 0) continue;
    points.clear();
    ends.clear();
    mesher.append_points(number, points, {}, &ends);
    for (std::size_t i = 0; i < points.size(); ++i) {
      FrontMesher::set_values(source, ends[i], here);
      const double value = source.components == 1 ? here[0] : std::hypot(here[0], here[1], here[2]);
      values[points[i].id] = std::isnan(value) ? rounded(least) : rounded(value);
    }
  }
  return values;
}

std::vector<float> values_of(std::span<const PointId> points, std::span<const float> values) {
  std::vector<float> found;
  found.reserve(points.size());
  for (const PointId point : points) found.push_back(values[point]);
  return found;
}

}  // namespace intervale
