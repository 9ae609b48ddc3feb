#include "common/picture/triangles.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "common/mesh/boundary.h"
#include "common/mesh/normals.h"
#include "common/mesh/plane_cut.h"

namespace intervale {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr std::size_t kAtOnce = 3 * 16384;

Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) { return normalized(cross(subtract(b, a), subtract(c, a))); }

// A triangle of a surface has all its points on it; every other triangle is part of a side of the box, which surfaces
// meet in lines only.
Part part_of(const Mesh& mesh, const Triangle& t) {
  const Surface surface = mesh.surface[t[0]];
  if (surface == Surface::inside || mesh.surface[t[1]] != surface || mesh.surface[t[2]] != surface) return Part::box;
  return surface == Surface::alpha ? Part::alpha : Part::beta;
}

// Each begins with the corner of least coordinates. Rounding follows the order of corners, and a picture must not
// depend on the order of the mesh's points and tetrahedra, which is arbitrary.
std::vector<Triangle> ordered_boundary(const Mesh& mesh) {
  std::vector<Triangle> triangles = boundary_triangles(mesh);
  for (Triangle& t : triangles)
    std::rotate(t.begin(), std::min_element(t.begin(), t.end(), [&](auto a, auto b) { return mesh.points[a] < mesh.points[b]; }), t.end());
  return triangles;
}

std::vector<NormalSum> smooth_normals(const Mesh& mesh, const std::vector<Triangle>& triangles) {
  std::vector<NormalSum> normals(mesh.points.size());
  const auto arc_tangent = [](double y, double x) { return std::atan2(y, x); };
  for (const Triangle& t : triangles) {
    if (part_of(mesh, t) == Part::box) continue;
    const auto added = angle_weighted_normals({mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]}, arc_tangent);
    for (std::size_t corner = 0; corner < 3; ++corner)
      for (std::size_t axis = 0; axis < 3; ++axis) normals[t[corner]][axis] += added[corner][axis];
  }
  return normals;
}

// Convex, counterclockwise; `count` of the corners. Side i leads from corner i to the next.
struct Polygon {
  unsigned count = 0;
  std::array<Vec3, 4> corners{}, normals{};
  std::array<double, 4> values{};  // within the span
  std::array<bool, 4> drawn{};

  void add(const Vec3& corner, const Vec3& normal, double value, bool side_drawn) {
    corners[count] = corner;
    normals[count] = normal;
    values[count] = value;
    drawn[count++] = side_drawn;
  }
};

// The part of a triangle behind the plane. The side along the plane is not drawn: it belongs to the cut.
Polygon clipped(const Polygon& triangle, const std::array<double, 3>& distances) {
  Polygon kept;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const double here = distances[i], there = distances[j];
    if (here < 0) kept.add(triangle.corners[i], triangle.normals[i], triangle.values[i], triangle.drawn[i]);
    if ((here < 0) == (there < 0)) continue;
    const bool leaves = here < 0;
    const std::size_t in = leaves ? i : j, out = leaves ? j : i;
    const Vec3 point = crossing(triangle.corners[in], distances[in], triangle.corners[out], distances[out]);
    const double t = distances[in] / (distances[in] - distances[out]);
    const double value = triangle.values[in] + t * (triangle.values[out] - triangle.values[in]);
    kept.add(point, normalized(lerp(triangle.normals[in], triangle.normals[out], t)), value, !leaves && triangle.drawn[i]);
  }
  return kept;
}

class Batch {
 public:
  Batch(const Viewpoint& viewpoint, const std::function<void(std::span<const Corner>)>& take) : viewpoint_(viewpoint), take_(take) {
    corners_.reserve(kAtOnce);
  }

  void add(const Polygon& polygon, Part part) {
    for (unsigned i = 1; i + 1 < polygon.count; ++i) {
      const bool first = i == 1, last = i + 2 == polygon.count;
      const bool opposite_0 = polygon.drawn[i], opposite_1 = last && polygon.drawn[i + 1], opposite_2 = first && polygon.drawn[0];
      const std::uint32_t look = std::uint32_t(part) | unsigned(opposite_0) << 2 | unsigned(opposite_1) << 3 | unsigned(opposite_2) << 4;
      for (const unsigned corner : {0u, i, i + 1}) {
        const Vec3& n = polygon.normals[corner];
        corners_.push_back(
            {viewpoint_.in_scene(polygon.corners[corner]), {float(n[0]), float(n[1]), float(n[2])}, look, float(polygon.values[corner])});
      }
      if (corners_.size() == kAtOnce) flush();
    }
  }

  void flush() {
    if (!corners_.empty()) take_(corners_);
    corners_.clear();
  }

 private:
  const Viewpoint& viewpoint_;
  const std::function<void(std::span<const Corner>)>& take_;
  std::vector<Corner> corners_;
};

// Where the values of points lie within the span; 0 without one.
class Values {
 public:
  explicit Values(const TriangleOptions& options) : values_(options.values), span_(options.span) {}
  [[nodiscard]] double at(std::uint32_t point) const { return span_ ? span_->at(values_[point]) : 0; }
  // Between two points.
  [[nodiscard]] double at(const CutEdge& on) const {
    const double kept = at(on.kept);
    return kept + on.fraction * (at(on.away) - kept);
  }

 private:
  std::span<const double> values_;
  const std::optional<ValueSpan>& span_;
};

void add_boundary(const Mesh& mesh, const TriangleOptions& options, Batch& batch) {
  const std::vector<Triangle> triangles = ordered_boundary(mesh);
  const auto smooth = smooth_normals(mesh, triangles);
  const Values values(options);
  const std::vector<double> distances = options.clip ? plane_distances(mesh, *options.clip) : std::vector<double>{};
  for (const Triangle& t : triangles) {
    const Part part = part_of(mesh, t);
    const Vec3 flat = normal_of(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]);
    if (flat == Vec3{}) continue;
    Polygon polygon;
    for (const std::uint32_t point : t) {
      const Vec3 normal = part == Part::box ? Vec3{} : normalized({double(smooth[point][0]), double(smooth[point][1]), double(smooth[point][2])});
      polygon.add(mesh.points[point], normal == Vec3{} ? flat : normal, values.at(point), options.edges);
    }
    if (options.clip) polygon = clipped(polygon, {distances[t[0]], distances[t[1]], distances[t[2]]});
    batch.add(polygon, part);
  }
}

void add_cut(const Mesh& mesh, const Plane& plane, const Values& values, Batch& batch) {
  const Vec3 normal = normalized(plane.normal);
  for (const TetCut& cut : plane_cut(mesh, plane)) {
    Polygon polygon;
    const auto corners = std::span(cut.corners).first(cut.count);
    const auto least = std::size_t(std::min_element(corners.begin(), corners.end()) - corners.begin());
    for (std::size_t i = 0; i < cut.count; ++i) {
      const std::size_t corner = (least + i) % cut.count;
      polygon.add(corners[corner], normal, values.at(cut.on[corner]), true);
    }
    batch.add(polygon, Part::cut);
  }
}

}  // namespace

void for_each_triangle(const Mesh& mesh, const TriangleOptions& options, const Viewpoint& viewpoint,
                       const std::function<void(std::span<const Corner>)>& take) {
  Batch batch(viewpoint, take);
  add_boundary(mesh, options, batch);
  if (options.clip) add_cut(mesh, *options.clip, Values(options), batch);
  batch.flush();
}

}  // namespace intervale
