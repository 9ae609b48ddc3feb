#include "client/view/values_at.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "common/front/channel_values.h"
#include "common/front/front.h"
#include "common/front/front_state.h"
#include "common/patch/channel.h"
#include "common/ranges/bisection.h"

namespace intervale {
namespace {

// A tetrahedron of the bisection, with its corners as in bisection.h, and a point's barycentric coordinates in it, clamped
// to the box.
struct PointInTet {
  std::array<Vertex, 4> corner{};
  std::array<double, 4> weight{};
  double least = -std::numeric_limits<double>::infinity();  // of the weights; of a flat tetrahedron
  int level = 0;                                            // bisections of the root's tetrahedra
};

Vec3 vec(Vertex v) { return {double(v.x), double(v.y), double(v.z)}; }

PointInTet place_in(const Domain& domain, const std::array<Vertex, 4>& corner, int level, const Vec3& point) {
  PointInTet place{corner, {}, -std::numeric_limits<double>::infinity(), level};
  std::array<Vec3, 4> from_point;
  for (std::size_t i = 0; i < 4; ++i) from_point[i] = subtract(vec(domain.clamp(corner[i])), point);
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {  // the volumes that the point makes with the faces; those of odd corners are turned
    const double volume = triple_product(from_point[(i + 1) % 4], from_point[(i + 2) % 4], from_point[(i + 3) % 4]);
    place.weight[i] = i % 2 == 0 ? volume : -volume;
    sum += place.weight[i];
  }
  if (std::abs(sum) < 0.5) return place;  // six times the volume: a whole number
  for (double& weight : place.weight) weight /= sum;
  place.least = *std::min_element(place.weight.begin(), place.weight.end());
  return place;
}

const FrontBlock* block_of(const FrontState& state, Vertex v, int scale) {
  return v == Vertex{} ? &state.origin : state.find_block(scale, {v.x >> (scale + 2), v.y >> (scale + 2), v.z >> (scale + 2)});
}

// Searches the bisection for the tetrahedron of the front that has a point. Where the box cuts a tetrahedron, its halves
// need not nest in it exactly (FORMAT.md, "The box"); but all that is made of it stays in the box around its corners. So
// others whose boxes have the point are searched as well, until it is found.
class Search {
 public:
  // point: in samples, in the box.
  Search(const FrontState& state, const Vec3& point) : state_(state), point_(point) {}

  PointInTet find() {
    std::array<PointInTet, kPaths.size()> all;
    for (std::size_t p = 0; p < kPaths.size(); ++p) {  // of the virtual grid
      std::array<Vertex, 4> corner{};
      for (std::size_t i = 0; i < 3; ++i) {
        corner[i + 1] = corner[i];
        (kPaths[p][i] == 0 ? corner[i + 1].x : kPaths[p][i] == 1 ? corner[i + 1].y : corner[i + 1].z) = 1 << state_.domain.levels();
      }
      all[p] = place_in(state_.domain, corner, 0, point_);
    }
    search(all);
    double sum = 0;
    for (double& weight : found_.weight) sum += weight = std::max(weight, 0.0);
    for (double& weight : found_.weight) weight /= sum;
    return found_;
  }

 private:
  // Searches those whose boxes have the point, the likeliest first.
  void search(std::span<PointInTet> tets) {
    for (auto next = tets.begin(); next != tets.end(); ++next) {
      std::iter_swap(next, std::max_element(next, tets.end(), [](const PointInTet& a, const PointInTet& b) { return a.least < b.least; }));
      if (found_.least > -1e-9) return;  // it has the point, up to rounding
      if (std::isfinite(next->least) && is_in_box_of(*next)) descend(*next);
    }
  }
  [[nodiscard]] bool is_in_box_of(const PointInTet& tet) const {
    std::array<bool, 3> is_above{}, is_below{};  // a corner at or beyond the point, on each axis
    for (const Vertex corner : tet.corner) {
      const Vec3 at = vec(state_.domain.clamp(corner));
      for (std::size_t k = 0; k < 3; ++k) {
        is_above[k] = is_above[k] || at[k] >= point_[k];
        is_below[k] = is_below[k] || at[k] <= point_[k];
      }
    }
    return is_above[0] && is_above[1] && is_above[2] && is_below[0] && is_below[1] && is_below[2];
  }

  void descend(const PointInTet& here) {
    const auto tail = std::size_t(tail_of_class(here.level % 3));
    const Vertex a = here.corner[0], b = here.corner[tail], middle{(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
    if (here.level == 3 * state_.domain.levels() || !is_shown(middle)) {
      if (here.least > found_.least) found_ = here;
      return;
    }
    std::array<Vertex, 4> at_start = here.corner, at_end = here.corner;
    at_start[tail] = middle;
    std::copy_n(here.corner.begin() + 1, tail, at_end.begin());
    at_end[tail] = middle;
    std::array<PointInTet, 2> halves{place_in(state_.domain, at_start, here.level + 1, point_),
                                     place_in(state_.domain, at_end, here.level + 1, point_)};
    search(halves);
  }
  [[nodiscard]] bool is_shown(Vertex centre) const {
    const int scale = scale_of(centre);
    const FrontBlock* const block = block_of(state_, centre, scale);
    return block != nullptr && block->is_shown(kSlotOfType[type_of(centre, scale)]);
  }

  const FrontState& state_;
  Vec3 point_;
  PointInTet found_;
};

double field_at(const FrontState& state, const PointInTet& place) {
  double value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vertex v = place.corner[i];
    const int scale = scale_of(v);
    const Slot slot = v == Vertex{} ? Slot() : kSlotOfType[type_of(v, scale)];
    value += place.weight[i] * state.values.format.value(block_of(state, v, scale)->key[slot]);
  }
  return value;
}

double channel_at(const ChannelValues& channel, const PointInTet& place) {
  const MeshChannel source = channel.for_mesh();
  std::array<double, kMaxComponents> at{}, total{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (place.weight[i] == 0) continue;
    source.values_at(place.corner[i], std::span(at).first(source.components));
    for (std::size_t c = 0; c < source.components; ++c) total[c] += place.weight[i] * at[c];
  }
  return source.components == 1 ? total[0] : length(total);
}

}  // namespace

std::optional<ValuesAt> values_at(const StreamClient& client, const Vec3& point) {
  const FrontState& first = client.front().state();
  Vec3 at = first.grid.affine.inverse().point(point);
  const Vec3 last = vec(first.domain.last());
  constexpr double kBeyond = 1e-3;  // as far as single precision takes a point of the box's side
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(at[i] >= -kBeyond && at[i] <= last[i] + kBeyond)) return {};
    at[i] = std::clamp(at[i], 0.0, last[i]);
  }
  const FrontState* finest = nullptr;
  PointInTet place;
  for (const Front& front : client.fronts()) {
    const PointInTet found = Search(front.state(), at).find();
    if (finest != nullptr && found.level <= place.level) continue;
    finest = &front.state();
    place = found;
  }
  ValuesAt values{field_at(*finest, place), {}};
  values.channels.reserve(client.channels().size());
  for (const ChannelValues& channel : client.channels()) values.channels.push_back(channel_at(channel, place));
  return values;
}

}  // namespace intervale
