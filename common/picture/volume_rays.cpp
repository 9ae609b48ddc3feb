#include "common/picture/volume_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <vector>

#include "common/picture/viewpoint.h"

namespace intervale {
namespace {

constexpr int kTile = 16;  // the pieces of its rays fit the cache
constexpr std::size_t kTetsAtOnce = 4096;
constexpr double kPixelMargin = 1e-5;  // in pixels, for kAside and the rounding of projections: no ray of a tetrahedron is missed
constexpr double kUnit = 0.02;         // a hundredth of the box's diagonal, in the scene
constexpr double kNearestRay = 1e-5;   // where the rays of an eye that is inside begin, ahead of it, in the scene
// From the middle of a pixel to its ray. A view along an axis of the grid has rays along edges of the mesh, where
// rounding decides which of the tetrahedra around have them, and not all decide alike. No such ray passes just beside.
constexpr std::array<double, 2> kAside{3.1e-6, 4.7e-6};

// Points relative to the eye: to the right, up and ahead. In units of the scene (viewpoint.h).
class Frame {
 public:
  explicit Frame(const VolumeRays& rays) : camera_(rays.camera), axes_(axes_of(rays.camera)) {
    const auto [width, height] = camera_.viewport;
    unit_ = length(subtract(rays.box.max, rays.box.min)) / 2;
    scale_ = height / (2 * std::tan(camera_.fov * std::numbers::pi / 360));
    middle_ = {width / 2.0, height / 2.0};
    const Vec3 centre = seen(lerp(rays.box.min, rays.box.max, 0.5));
    nearest_ = std::max(kNearestRay, centre[2] - 1);
    if (!rays.clip) return;
    const Vec3 normal = normalized(rays.clip->normal);
    clip_normal_ = {dot(normal, axes_.right), dot(normal, axes_.up), -dot(normal, axes_.back)};
    clip_distance_ = dot(clip_normal_, seen(rays.clip->point));
  }

  [[nodiscard]] Vec3 seen(const Vec3& world) const {
    const Vec3 p = subtract(world, camera_.eye);
    return {dot(p, axes_.right) / unit_, dot(p, axes_.up) / unit_, -dot(p, axes_.back) / unit_};
  }
  [[nodiscard]] int width() const { return camera_.viewport[0]; }
  [[nodiscard]] int height() const { return camera_.viewport[1]; }
  // Where rays begin, as a distance ahead of the eye.
  [[nodiscard]] double nearest() const { return nearest_; }
  // The place of a point in the picture, in pixels, where whole numbers are the middles of pixels.
  [[nodiscard]] std::array<double, 2> pixel(const Vec3& p) const {
    return {p[0] / p[2] * scale_ + middle_[0] - 0.5, middle_[1] - 0.5 - p[1] / p[2] * scale_};
  }
  // The point of a pixel's ray at distance 1 ahead.
  [[nodiscard]] Vec3 ray(int column, int row) const {
    return {(column + 0.5 + kAside[0] - middle_[0]) / scale_, (middle_[1] - row - 0.5 - kAside[1]) / scale_, 1};
  }
  // The distances ahead between which the clip plane leaves a ray.
  [[nodiscard]] std::array<double, 2> kept(const Vec3& ray) const {
    const double rise = dot(clip_normal_, ray);
    if (rise > 0) return {nearest_, clip_distance_ / rise};
    if (rise < 0) return {std::max(nearest_, clip_distance_ / rise), INFINITY};
    return {nearest_, clip_distance_ < 0 ? -INFINITY : INFINITY};
  }

 private:
  Camera camera_;
  Axes axes_;
  double unit_ = 1, scale_ = 1, nearest_ = kNearestRay;
  std::array<double, 2> middle_{};
  Vec3 clip_normal_{};  // without a clip plane, 0: all is kept
  double clip_distance_ = 0;
};

// Pixels whose rays may meet a tetrahedron.
RayTile pixels_of(const Frame& frame, const std::array<Vec3, 4>& corners) {
  std::array<double, 2> least{INFINITY, INFINITY}, most{-INFINITY, -INFINITY};
  const auto widen = [&](const Vec3& p) {
    const auto at = frame.pixel(p);
    for (std::size_t i = 0; i < 2; ++i) {
      least[i] = std::min(least[i], at[i]);
      most[i] = std::max(most[i], at[i]);
    }
  };
  for (std::size_t i = 0; i < 4; ++i) {
    if (corners[i][2] >= frame.nearest()) widen(corners[i]);
    for (std::size_t j = 0; j < i; ++j) {
      const double here = corners[i][2] - frame.nearest(), there = corners[j][2] - frame.nearest();
      if ((here < 0) == (there < 0)) continue;
      Vec3 crossing = lerp(corners[i], corners[j], here / (here - there));
      crossing[2] = frame.nearest();
      widen(crossing);
    }
  }
  const auto within = [](double pixel, int count) { return int(std::clamp(pixel, 0.0, double(count))); };
  return {within(std::ceil(least[0] - kPixelMargin), frame.width()), within(std::ceil(least[1] - kPixelMargin), frame.height()),
          within(std::floor(most[0] + kPixelMargin) + 1, frame.width()), within(std::floor(most[1] + kPixelMargin) + 1, frame.height())};
}

// A piece of a ray: distances along it, and places of values (TransferFunction) at its ends.
struct Piece {
  float begin = 0, end = 0, from = 0, to = 0;
  // An order that does not depend on the order of the tetrahedra.
  friend bool operator<(const Piece& a, const Piece& b) {
    if (a.begin != b.begin) return a.begin < b.begin;
    return std::array{a.end, a.from, a.to} < std::array{b.end, b.from, b.to};
  }
};

struct Ray {
  Vec3 at;                      // at distance 1 ahead
  double slant;                 // its length
  std::array<double, 2> ahead;  // the distances ahead between which it is followed
};

// A tetrahedron that is ready to be met by rays.
//
// Face k, opposite corner k, lies in the plane normal . p = distance. Both tetrahedra of a face have the same numbers:
// corners are in an order that is theirs.
class Solid {
 public:
  // Corners as Frame::seen() gives them, and the places of their values.
  Solid(std::array<Vec3, 4> corners, std::array<double, 4> places) {
    sort(corners, places);
    const double sixfold = triple_product(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]), subtract(corners[3], corners[0]));
    is_flat_ = !(std::abs(sixfold) > 0);
    start_ = places[0];
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3 &a = corners[k == 0 ? 1 : 0], &b = corners[k <= 1 ? 2 : 1], &c = corners[k <= 2 ? 3 : 2];
      const Vec3 normal = cross(subtract(b, a), subtract(c, a));
      for (std::size_t i = 0; i < 3; ++i) normal_[i][k] = normal[i];
      distance_[k] = dot(normal, a);
      inward_[k] = (sixfold > 0) == (k % 2 == 1) ? 1 : -1;
      rise_[k] = inward_[k] * (places[k] - places[0]) / std::abs(sixfold);
      start_ -= rise_[k] * distance_[k];
    }
    std::tie(least_, most_) = std::minmax({places[0], places[1], places[2], places[3]});
    std::tie(ahead_[0], ahead_[1]) = std::minmax({corners[0][2], corners[1][2], corners[2][2], corners[3][2]});
  }

  [[nodiscard]] bool is_flat() const { return is_flat_; }

  // Whether it meets a ray; and the piece that it cuts from it, counted from the distance `nearest` ahead. Faces are
  // lanes of vectors: most of the time is spent here.
  [[nodiscard]] bool meets(const Ray& ray, double nearest, Piece& piece) const {
    Lanes slope, enters, leaves;
    for (std::size_t k = 0; k < 4; ++k) slope[k] = normal_[0][k] * ray.at[0] + normal_[1][k] * ray.at[1] + normal_[2][k];
    for (std::size_t k = 0; k < 4; ++k) {
      const double ahead = distance_[k] / slope[k], in = slope[k] * inward_[k];
      enters[k] = in > 0 ? ahead : -INFINITY;
      leaves[k] = in < 0 ? ahead : INFINITY;
    }
    const double begin = std::max({enters[0], enters[1], enters[2], enters[3], ray.ahead[0], ahead_[0]});
    const double end = std::min({leaves[0], leaves[1], leaves[2], leaves[3], ray.ahead[1], ahead_[1]});
    if (!(begin < end) || !has_sides_of(slope)) return false;
    double rise = 0;
    for (std::size_t k = 0; k < 4; ++k) rise += rise_[k] * slope[k];
    const auto place = [&](double ahead) { return float(std::clamp(start_ + rise * ahead, least_, most_)); };
    piece = {float((begin - nearest) * ray.slant), float((end - nearest) * ray.slant), place(begin), place(end)};
    return piece.begin < piece.end;
  }

 private:
  using Lanes = std::array<double, 4>;

  static void sort(std::array<Vec3, 4>& corners, std::array<double, 4>& places) {
    for (const auto& [i, j] : {std::array<std::size_t, 2>{0, 1}, {2, 3}, {0, 2}, {1, 3}, {1, 2}}) {
      if (!(corners[j] < corners[i])) continue;
      std::swap(corners[i], corners[j]);
      std::swap(places[i], places[j]);
    }
  }

  // A ray along a face belongs to one of its two tetrahedra.
  [[nodiscard]] bool has_sides_of(const Lanes& slope) const {
    for (std::size_t k = 0; k < 4; ++k) {
      if (slope[k] == 0 && (distance_[k] < 0) != (inward_[k] > 0)) return false;
    }
    return true;
  }

  std::array<Lanes, 3> normal_{};
  Lanes distance_{};
  Lanes inward_{};  // 1 or -1: the fourth corner is on the normal's side, or on the other
  Lanes rise_{};    // what the place changes by with normal . p, by the fourth corner
  double start_ = 0, least_ = 0, most_ = 0;
  std::array<double, 2> ahead_{};
  bool is_flat_ = false;
};

// Which tetrahedra lie in which tile.
class Bins {
 public:
  Bins(const Mesh& mesh, const Frame& frame, const ParallelFor& parallel)
      : across_((frame.width() + kTile - 1) / kTile), down_((frame.height() + kTile - 1) / kTile) {
    std::vector<Cover> covers(mesh.tets.size());
    parallel((mesh.tets.size() + kTetsAtOnce - 1) / kTetsAtOnce, [&](std::size_t chunk) {
      const std::size_t last = std::min(mesh.tets.size(), (chunk + 1) * kTetsAtOnce);
      for (std::size_t t = chunk * kTetsAtOnce; t < last; ++t) covers[t] = cover_of(mesh, frame, t);
    });
    begins_.resize(count() + 2);
    for (const Cover& cover : covers) for_each_tile(cover, [this](std::size_t tile) { ++begins_[tile + 2]; });
    for (std::size_t tile = 2; tile < begins_.size(); ++tile) begins_[tile] += begins_[tile - 1];
    tets_.resize(begins_.back());
    for (std::size_t t = 0; t < covers.size(); ++t)
      for_each_tile(covers[t], [this, t](std::size_t tile) { tets_[begins_[tile + 1]++] = std::uint32_t(t); });
  }

  [[nodiscard]] std::size_t count() const { return std::size_t(across_) * std::size_t(down_); }
  [[nodiscard]] std::span<const std::uint32_t> tets(std::size_t tile) const {
    return std::span(tets_).subspan(begins_[tile], begins_[tile + 1] - begins_[tile]);
  }
  [[nodiscard]] RayTile place(std::size_t tile, const Frame& frame) const {
    const int left = int(tile) % across_ * kTile, top = int(tile) / across_ * kTile;
    return {left, top, std::min(left + kTile, frame.width()), std::min(top + kTile, frame.height())};
  }

 private:
  struct Cover {
    std::uint16_t left = 0, top = 0, right = 0, bottom = 0;  // tiles; empty where right is left
  };
  static Cover cover_of(const Mesh& mesh, const Frame& frame, std::size_t t) {
    std::array<Vec3, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = frame.seen(mesh.points[mesh.tets[t][i]]);
    const RayTile pixels = pixels_of(frame, corners);
    if (pixels.left >= pixels.right || pixels.top >= pixels.bottom) return {};
    return {std::uint16_t(pixels.left / kTile), std::uint16_t(pixels.top / kTile), std::uint16_t((pixels.right - 1) / kTile + 1),
            std::uint16_t((pixels.bottom - 1) / kTile + 1)};
  }
  template <class Call>
  void for_each_tile(const Cover& cover, const Call& call) const {
    for (int row = cover.top; row < cover.bottom; ++row)
      for (int column = cover.left; column < cover.right; ++column) call(std::size_t(row) * std::size_t(across_) + std::size_t(column));
  }

  int across_, down_;
  std::vector<std::uint64_t> begins_;  // of each tile's tetrahedra
  std::vector<std::uint32_t> tets_;
};

// The pieces of all rays of a tile: of each ray a list, in no order.
class Pieces {
 public:
  explicit Pieces(std::size_t rays) : heads_(rays, kNone) {}
  void add(std::size_t ray, const Piece& piece) {
    nodes_.push_back({piece, heads_[ray]});
    heads_[ray] = nodes_.size() - 1;
  }
  // Sorted by where they begin; valid until the next call.
  [[nodiscard]] std::span<const Piece> of(std::size_t ray) {
    sorted_.clear();
    for (std::size_t i = heads_[ray]; i != kNone; i = nodes_[i].next) sorted_.push_back(nodes_[i].piece);
    std::sort(sorted_.begin(), sorted_.end());
    return sorted_;
  }

 private:
  static constexpr std::size_t kNone = ~std::size_t(0);
  struct Node {
    Piece piece;
    std::size_t next = kNone;
  };
  std::vector<std::size_t> heads_;
  std::vector<Node> nodes_;
  std::vector<Piece> sorted_;
};

struct TileRays {
  RayTile tile;
  std::span<const Ray> rays;  // row by row
};

// Adds what a tetrahedron cuts from the rays of a tile.
void cut(const Mesh& mesh, std::uint32_t tet, const ValueSpan& values, const Frame& frame, const TileRays& through, Pieces& pieces) {
  std::array<Vec3, 4> corners;
  std::array<double, 4> places;
  for (std::size_t i = 0; i < 4; ++i) {
    corners[i] = frame.seen(mesh.points[mesh.tets[tet][i]]);
    places[i] = std::clamp(values.at(mesh.value[mesh.tets[tet][i]]), 0.0, 1.0);
  }
  const Solid solid(corners, places);
  if (solid.is_flat()) return;
  const RayTile &tile = through.tile, pixels = pixels_of(frame, corners);
  for (int row = std::max(pixels.top, tile.top); row < std::min(pixels.bottom, tile.bottom); ++row) {
    for (int column = std::max(pixels.left, tile.left); column < std::min(pixels.right, tile.right); ++column) {
      const std::size_t ray = std::size_t(row - tile.top) * std::size_t(tile.right - tile.left) + std::size_t(column - tile.left);
      Piece piece;
      if (solid.meets(through.rays[ray], frame.nearest(), piece)) pieces.add(ray, piece);
    }
  }
}

// Each part of the ray counts once: of what overlaps, what begins first.
RayLight light_of(std::span<const Piece> pieces, const TransferFunction& transfer) {
  RayLight light;
  float reached = 0;
  for (const Piece& piece : pieces) {
    if (piece.end <= reached) continue;
    const float begin = std::max(reached, piece.begin);
    const double t = (double(begin) - piece.begin) / (double(piece.end) - piece.begin);
    transfer.add(light, piece.from + t * (double(piece.to) - piece.from), piece.to, (double(piece.end) - begin) / kUnit);
    reached = piece.end;
  }
  return light;
}

}  // namespace

void trace_rays(const Mesh& mesh, const VolumeRays& rays, const TransferFunction& transfer, const ParallelFor& parallel,
                const std::function<void(const RayTile& tile, std::span<const RayLight> light)>& take) {
  const Frame frame(rays);
  const Bins bins(mesh, frame, parallel);
  parallel(bins.count(), [&](std::size_t number) {
    const RayTile tile = bins.place(number, frame);
    const std::size_t across = std::size_t(tile.right - tile.left), count = across * std::size_t(tile.bottom - tile.top);
    std::vector<Ray> through(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 at = frame.ray(tile.left + int(i % across), tile.top + int(i / across));
      through[i] = {at, std::sqrt(dot(at, at)), frame.kept(at)};
    }
    Pieces pieces(count);
    for (const std::uint32_t tet : bins.tets(number)) cut(mesh, tet, rays.values, frame, {tile, through}, pieces);
    std::vector<RayLight> light(count);
    for (std::size_t i = 0; i < count; ++i) light[i] = light_of(pieces.of(i), transfer);
    take(tile, light);
  });
}

}  // namespace intervale
