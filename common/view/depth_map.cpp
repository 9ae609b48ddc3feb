#include "common/view/depth_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace intervale {
namespace {

constexpr float kOpen = std::numeric_limits<float>::infinity();

// A camera's axes, of length 1.
struct Sight {
  Vec3 right, up, ahead;
};

Sight sight_of(const Camera& camera) {
  const Vec3 ahead = normalized(subtract(camera.look_at, camera.eye)), right = normalized(cross(ahead, normalized(camera.up)));
  return {right, cross(right, ahead), ahead};
}

// Cells of one unit across, one unit ahead, if the picture has `cells` from top to bottom.
double cells_per_unit(const Camera& camera, int cells) { return cells / (2 * std::tan(camera.fov * (std::numbers::pi / 360))); }

double reach_on(const Vec3& reach, const Vec3& n) { return reach[0] * std::abs(n[0]) + reach[1] * std::abs(n[1]) + reach[2] * std::abs(n[2]); }

// Cells that a span of the picture touches: first and last, within 0 to count - 1; none if it is beside the picture.
struct Cells {
  int first = 0, last = -1;
};
Cells cells_of(double low, double high, int count) {
  if (!(high >= 0 && low <= count)) return {};
  return {int(std::max(0.0, std::floor(low))), int(std::min(double(count - 1), std::floor(high)))};
}

}  // namespace

double DepthMap::depth_of(std::uint8_t code) const { return nearest * std::pow(farthest / nearest, double(code) / kLastCode); }

Result<void> check_depth_map(const DepthMap& map) {
  const auto is_side = [](int cells) { return cells >= 1 && cells <= DepthMap::kMaxSide; };
  if (!is_side(map.width) || !is_side(map.height) || map.codes.size() != std::size_t(map.width) * std::size_t(map.height))
    return fail("a depth map has 1 to " + std::to_string(DepthMap::kMaxSide) + " cells a side, and a depth for each");
  if (!(map.nearest > 0 && map.nearest <= map.farthest && std::isfinite(map.farthest))) return fail("the depths of a map are above 0 and finite");
  return {};
}

DepthBuffer::DepthBuffer(const Camera& camera) : eye_(camera.eye) {
  const Sight sight = sight_of(camera);
  right_ = sight.right;
  up_ = sight.up;
  ahead_ = sight.ahead;
  // The longer side has all the cells that there may be.
  const double width = camera.viewport[0], height = camera.viewport[1], longer = std::max(width, height);
  const auto cells = [longer](double side) { return std::max(1, int(std::round(DepthMap::kMaxSide * side / longer))); };
  columns_ = kSamples * cells(width);
  rows_ = kSamples * cells(height);
  scale_y_ = cells_per_unit(camera, rows_);
  scale_x_ = scale_y_ * height / width * columns_ / rows_;
  nearness_.assign(std::size_t(columns_) * std::size_t(rows_), 0);
}

void DepthBuffer::draw(const std::array<Vec3, 3>& triangle) {
  std::array<double, 3> x{}, y{}, near{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 at = subtract(triangle[i], eye_);
    const double depth = dot(at, ahead_);
    if (!(depth > 0)) return;
    near[i] = 1 / depth;
    x[i] = columns_ * 0.5 + scale_x_ * dot(at, right_) * near[i];
    y[i] = rows_ * 0.5 - scale_y_ * dot(at, up_) * near[i];
  }
  const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  if (!(std::abs(area) > 0) || !std::isfinite(area)) return;
  const auto [left, right] = std::minmax({x[0], x[1], x[2]});
  const auto [top, bottom] = std::minmax({y[0], y[1], y[2]});
  const Cells columns = cells_of(left - 0.5, right + 0.5, columns_), rows = cells_of(top - 0.5, bottom + 0.5, rows_);
  for (int row = rows.first; row <= rows.last; ++row) {
    for (int column = columns.first; column <= columns.last; ++column) {
      const double px = column + 0.5, py = row + 0.5;
      double nearness = 0;
      bool is_inside = true;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        const double share = ((x[j] - px) * (y[k] - py) - (x[k] - px) * (y[j] - py)) / area;
        is_inside &= share >= 0;
        nearness += share * near[i];
      }
      float& nearest = nearness_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
      if (is_inside && float(nearness) > nearest) nearest = float(nearness);
    }
  }
}

DepthMap DepthBuffer::map() const {
  DepthMap map;
  map.width = columns_ / kSamples;
  map.height = rows_ / kSamples;
  std::vector<float> least(std::size_t(map.width) * std::size_t(map.height), kOpen);  // nearness of the farthest
  float lowest = kOpen, highest = 0;
  for (std::size_t i = 0; i < nearness_.size(); ++i) {
    const std::size_t row = i / std::size_t(columns_), column = i % std::size_t(columns_);
    float& cell = least[row / kSamples * std::size_t(map.width) + column / kSamples];
    cell = std::min(cell, nearness_[i]);
  }
  for (const float nearness : least) {
    if (nearness == 0) continue;
    lowest = std::min(lowest, nearness);
    highest = std::max(highest, nearness);
  }
  map.codes.assign(least.size(), DepthMap::kOpenCode);
  if (!(highest > 0 && std::isfinite(highest) && std::isfinite(1 / lowest))) return map;
  map.nearest = 1 / double(highest);
  map.farthest = std::max(map.nearest, 1 / double(lowest));
  const double octaves = std::log(map.farthest / map.nearest);
  for (std::size_t i = 0; i < least.size(); ++i) {
    if (least[i] == 0) continue;
    const double share = octaves > 0 ? std::log(1 / double(least[i]) / map.nearest) / octaves : 0;
    map.codes[i] = std::uint8_t(std::clamp(std::ceil(share * DepthMap::kLastCode), 0.0, double(DepthMap::kLastCode)));
  }
  return map;
}

Occlusion::Occlusion(const DepthMap& map, const Camera& camera, const Grid& grid) : turned_(grid.affine), eye_(turned_.turned(camera.eye)) {
  const Sight sight = sight_of(camera);
  right_ = turned_.turned(sight.right);
  up_ = turned_.turned(sight.up);
  ahead_ = turned_.turned(sight.ahead);
  scale_y_ = cells_per_unit(camera, map.height);
  scale_x_ = scale_y_ * camera.viewport[1] / camera.viewport[0] * map.width / map.height;
  for (int code = 0; code < 256; ++code) depth_[std::size_t(code)] = code == DepthMap::kOpenCode ? kOpen : float(map.depth_of(std::uint8_t(code)));
  levels_.push_back({map.width, map.height, map.codes});
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& finer = levels_.back();
    Level next{(finer.width + 1) / 2, (finer.height + 1) / 2, {}};
    next.codes.resize(std::size_t(next.width) * std::size_t(next.height));
    for (int y = 0; y < finer.height; ++y) {
      for (int x = 0; x < finer.width; ++x) {
        std::uint8_t& cell = next.codes[std::size_t(y / 2 * next.width + x / 2)];
        cell = std::max(cell, finer.codes[std::size_t(y * finer.width + x)]);
      }
    }
    levels_.push_back(std::move(next));
  }
}

std::size_t Occlusion::memory_bytes() const {
  std::size_t bytes = levels_.capacity() * sizeof levels_[0];
  for (const Level& level : levels_) bytes += level.codes.capacity();
  return bytes;
}

// The region lies between two depths, and within a span across the line of sight; so its picture lies between the least
// and the greatest of the spans' ends over both depths. It is compared with few cells: those of the first level of which
// it touches at most two on each axis.
bool Occlusion::hides(const ScreenError::Region& region) const {
  const Vec3 at = subtract(turned_.map.point(region.middle), eye_), reach = turned_.map.reach(region.reach);
  const double ahead = dot(at, ahead_), deep = reach_on(reach, ahead_), nearest = ahead - deep, farthest = ahead + deep;
  if (!(nearest > 0)) return false;
  const auto span = [&](const Vec3& axis, double scale, double middle, int count) {
    const double across = scale * dot(at, axis), far = scale * reach_on(reach, axis), low = across - far, high = across + far;
    return cells_of(middle + std::min(low / nearest, low / farthest), middle + std::max(high / nearest, high / farthest), count);
  };
  const Level& finest = levels_.front();
  Cells columns = span(right_, scale_x_, 0.5 * finest.width, finest.width);
  Cells rows = span(scaled(-1, up_), scale_y_, 0.5 * finest.height, finest.height);
  if (columns.first > columns.last || rows.first > rows.last) return false;  // beside the picture
  std::size_t level = 0;
  while (columns.last - columns.first > 1 || rows.last - rows.first > 1) {
    for (int* cell : {&columns.first, &columns.last, &rows.first, &rows.last}) *cell /= 2;
    ++level;
  }
  const double clear = nearest - length(reach);
  for (int y = rows.first; y <= rows.last; ++y) {
    for (int x = columns.first; x <= columns.last; ++x) {
      const std::uint8_t code = levels_[level].codes[std::size_t(y * levels_[level].width + x)];
      if (!(clear > double(depth_[code]))) return false;
    }
  }
  return true;
}

}  // namespace intervale
