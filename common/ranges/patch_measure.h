// How far the patches of a diamond's tetrahedra are from the surfaces of the full mesh, at some of their points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "common/diamond/affine.h"
#include "common/diamond/domain.h"
#include "common/ranges/cube_crossings.h"
#include "common/ranges/field.h"
#include "common/ranges/patch_polygon.h"
#include "common/util/bits.h"
#include "common/util/vec3.h"

namespace intervale {

// The field in the finest tetrahedra: the cells, each bisected along paths from the corner with even coordinates to the
// one with odd ones.
template <class T>
class FinestField {
 public:
  // The field must outlive it.
  explicit FinestField(const Field<T>& field)
      : field_(field),
        stride_{1, field.last.x + 1, std::ptrdiff_t(field.last.x + 1) * (field.last.y + 1)},
        last_{field.last.x, field.last.y, field.last.z} {}

  // At a point in sample coordinates, or the point of the box that is nearest to it. What is not a number counts as 0.
  [[nodiscard]] double at(const Vec3& p) const {
    const T* sample = field_.samples.data();
    std::array<std::pair<double, std::ptrdiff_t>, 3> step;  // how far along each axis, and to which sample
    for (int k = 0; k < 3; ++k) {
      const double c = p[k] > 0 ? std::min(p[k], double(last_[k])) : 0;
      const std::int32_t cell = std::min(std::int32_t(c), last_[k] - 1);
      const bool is_back = (cell & 1) != 0;
      sample += stride_[k] * (is_back ? cell + 1 : cell);
      step[k] = {is_back ? cell + 1 - c : c - cell, is_back ? -stride_[k] : stride_[k]};
    }
    if (step[0].first < step[1].first) std::swap(step[0], step[1]);
    if (step[1].first < step[2].first) std::swap(step[1], step[2]);
    if (step[0].first < step[1].first) std::swap(step[0], step[1]);
    double before = double(*sample), value = before;
    for (const auto& [along, to] : step) {
      sample += to;
      const double next = double(*sample);
      value += along * (next - before);
      before = next;
    }
    return value;
  }

 private:
  const Field<T>& field_;
  std::array<std::ptrdiff_t, 3> stride_;  // between neighbouring samples along each axis
  std::array<std::int32_t, 3> last_;
};

template <class T>
class PatchMeasure {
 public:
  // field and domain must outlive it.
  PatchMeasure(const Field<T>& field, const Affine& affine, const Domain& domain) : field_(field), finest_(field), affine_(affine), domain_(domain) {
    const Vec3 spacing = affine.spacing();
    step_ = std::min({spacing[0], spacing[1], spacing[2]});
    const Affine inverse = affine.inverse();
    for (int k = 0; k < 3; ++k) {
      Vec3 axis{};
      axis[k] = 1;
      to_step_[k] = inverse.direction(inverse.transposed(axis));
    }
  }

  // The distance from where a patch cuts the diamond's spine to the nearest crossing of the field on it, in world units.
  [[nodiscard]] double at_spine(const Diamond& d, const Isosurfaces& surfaces) const {
    const Vertex a = d.vertex(0), b = d.vertex(1);
    if (!domain_.contains(a) || !domain_.contains(b)) return 0;
    const T* const samples = &field_.samples[field_.index(a)];
    const T* const end = &field_.samples[field_.index(b)];
    const int steps = 2 * d.h;
    const double first = double(*samples), last = double(*end);
    double far = 0;
    for (int k = 0; k < surfaces.count; ++k) {
      const Isosurface& surface = surfaces.surface[k];
      if (!surface.separates(first, last)) continue;
      const std::ptrdiff_t stride = (end - samples) / steps;
      const double cut = steps * part_of(surface.value, first, last);
      double nearest = steps;
      for (int i = 0; i < steps; ++i) {
        const double u = double(samples[i * stride]), w = double(samples[(i + 1) * stride]);
        if (surface.separates(u, w)) nearest = std::min(nearest, std::abs(i + part_of(surface.value, u, w) - cut));
      }
      far = std::max(far, nearest);
    }
    if (far == 0) return 0;
    return far * length(affine_.direction({double(b.x - a.x) / steps, double(b.y - a.y) / steps, double(b.z - a.z) / steps}));
  }

  // The larger of `known` and the distances of points within the patches to the nearest place where the field crosses
  // the surface, straight up or down from the patch or along the spine; no more than `width`, the diamond's. In world units.
  [[nodiscard]] double within_patches(const Diamond& d, const Isosurfaces& surfaces, double known, double width) const {
    if (!d.has_children() && !makes_hole(d, surfaces)) return known;
    std::array<double, kMaxVertices> value;
    unsigned outside = 0;  // vertices outside the box
    for (int i = 0; i < d.row->vertices; ++i) {
      const Vertex v = d.vertex(i), clamped = domain_.clamp(v);
      outside |= unsigned(v != clamped) << i;
      value[i] = field_.at(clamped);
    }
    for (int k = 0; k < surfaces.count; ++k) {
      const Isosurface& surface = surfaces.surface[k];
      unsigned low = 0, high = 0;  // vertices on both sides
      for (int i = 0; i < d.row->vertices; ++i) (surface.separates(value[0], value[i]) ? high : low) |= 1U << i;
      if (high == 0) continue;
      for (const int tet : set_bits(domain_.tets(d))) {
        if (known >= width) return known;
        const unsigned corners = d.row->tet_vertices[tet];
        if ((corners & outside) == 0 && (corners & low) != 0 && (corners & high) != 0) known = within_patch(d, tet, value, surface, known, width);
      }
    }
    return known;
  }

 private:
  // Whether the centre is on another side than both ends of the spine. If not, splitting the diamond only moves the corners
  // of patches.
  [[nodiscard]] bool makes_hole(const Diamond& d, const Isosurfaces& surfaces) const {
    const double first = field_.at(domain_.clamp(d.vertex(0))), second = field_.at(domain_.clamp(d.vertex(1)));
    const double centre = field_.at(domain_.clamp(d.centre));
    return std::any_of(surfaces.surface.begin(), surfaces.surface.begin() + surfaces.count,
                       [=](const Isosurface& surface) { return surface.separates(first, centre) && surface.separates(second, centre); });
  }

  [[nodiscard]] double within_patch(const Diamond& d, int tet, const std::array<double, kMaxVertices>& value, const Isosurface& surface, double known,
                                    double width) const {
    std::array<Vec3, 4> corner;  // in samples
    std::array<double, 4> corner_value;
    for (int i = 0; i < 4; ++i) {
      const int v = d.row->tet(tet)[i];
      const Vertex at = d.vertex(v);
      corner[i] = {double(at.x), double(at.y), double(at.z)};
      corner_value[i] = value[v];
    }
    const PatchPolygon patch(corner, corner_value, surface);
    const Vec3 normal = cross(subtract(patch.corner[1], patch.corner[0]), subtract(patch.corner[2], patch.corner[0]));
    const Vec3 up = {dot(to_step_[0], normal), dot(to_step_[1], normal), dot(to_step_[2], normal)};
    const double square = dot(up, normal);
    if (!(square > 0) || std::isinf(square)) return known;  // or the spacing is beyond what squares can tell
    const Vec3 spine = subtract(corner[1], corner[0]), middle = patch.middle();
    const std::array<Vec3, 2> steps{scaled(1 / std::sqrt(square), up), scaled(1 / length(affine_.direction(spine)), spine)};
    known = std::max(known, to_surface(middle, steps, surface, known, width));
    for (int i = 0; i < patch.count && d.h > 2; ++i)
      known = std::max(known, to_surface(lerp(middle, patch.corner[i], 0.5), steps, surface, known, width));
    return known;
  }

  // From a point to the nearest crossing of the field along two lines, in world units; no more than `most`. If it is no
  // more than `enough`, any number up to that. steps: along each line, in samples, for one world unit.
  [[nodiscard]] double to_surface(const Vec3& from, const std::array<Vec3, 2>& steps, const Isosurface& surface, double enough, double most) const {
    const auto value = [&](double distance, const Vec3& step) {
      return finest_.at({from[0] + distance * step[0], from[1] + distance * step[1], from[2] + distance * step[2]});
    };
    const double up = value(enough, steps[0]);
    if (surface.separates(up, value(-enough, steps[0]))) return enough;
    const double here = finest_.at(from);
    if (surface.separates(up, here)) return enough;
    if (surface.separates(here, value(enough, steps[1])) || surface.separates(here, value(-enough, steps[1]))) return enough;
    std::array<double, 4> last{here, here, here, here};  // to both sides of each line
    const double step = std::max(step_, most / kMostSteps);
    double before = 0;
    for (int i = 0; i < kMostSteps && before < most; ++i) {
      const double distance = std::min(before + step, most);
      double nearest = kInfinity;
      for (int side = 0; side < 4; ++side) {
        const double next = value(side % 2 == 0 ? distance : -distance, steps[side / 2]);
        if (surface.separates(here, next)) nearest = std::min(nearest, part_of(surface.value, last[side], next));
        last[side] = next;
      }
      if (nearest < kInfinity) return before + nearest * (distance - before);
      before = distance;
    }
    return most;
  }

  static constexpr int kMostSteps = 64;  // along a line; enough for each sample in widths of diamonds of scale 4, if spacings are alike
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Field<T>& field_;
  FinestField<T> finest_;
  Affine affine_;  // of the grid
  const Domain& domain_;
  // From a normal in samples, as of a gradient, to that direction in the world, in samples again: a symmetric matrix.
  std::array<Vec3, 3> to_step_;
  double step_ = 0;  // the least spacing
};

}  // namespace intervale
