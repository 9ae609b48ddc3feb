// How far the points where the field crosses a surface are from the patches of a coarser mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/diamond/affine.h"
#include "common/diamond/domain.h"
#include "common/ranges/bisection.h"
#include "common/ranges/cube_crossings.h"
#include "common/ranges/field.h"
#include "common/ranges/patch_polygon.h"
#include "common/util/bits.h"
#include "common/util/vec3.h"

namespace intervale {

// The plane of the patch in a tetrahedron. Lengths are in units of `width`.
class PatchPlane {
 public:
  // isovalue: where the values at the corners have their 0, too. No plane if all of those are equal. The tetrahedron and
  // the grid's map must outlive it.
  PatchPlane(const BisectionTet& tet, const Affine& affine, double isovalue, double width)
      : tet_(tet), affine_(affine), inverse_slope_(1 / std::sqrt(dot(tet.gradient, tet.gradient))), width_(width) {
    const double to_widths = inverse_slope_ / width;
    for (int i = 0; i < 4; ++i) {
      to_plane_[i] = float((isovalue - double(tet.corner[i].value)) * to_widths);
      step_[i] = float(turned(i) * width);
    }
  }

  // A signed distance.
  [[nodiscard]] float distance(const Crossing& c) const { return sum(c * to_plane_); }

  // The square of the distance to the patch, if the tetrahedron has it, and if its nearest point is straight below; or on a
  // side, where the patch ends on that way; or at a corner of the patch, where that passes two faces. If not, nothing.
  [[nodiscard]] std::optional<float> squared_distance_to_patch(const Crossing& c) {
    const float off = distance(c);
    const Crossing foot = c + off * step_;
    if (is_inside(foot)) return off * off;
    std::array<int, 4> face;  // those that the way leads through, and then the others
    int past = 0, others = 4;
    for (int i = 0; i < 4; ++i) face[foot[i] < -kOutside ? past++ : --others] = i;
    if (past == 1) {
      const Way& way = way_past(face[0]);
      if (!is_inside(foot - foot[face[0]] * way.to)) return {};
      return off * off + foot[face[0]] * foot[face[0]] * way.squared_length;
    }
    return past == 2 ? squared_distance_to_cut(c, face[2], face[3]) : std::nullopt;
  }

 private:
  static constexpr float kOutside = 1e-4F;   // a coordinate below minus that is of a point outside
  static constexpr double kParallel = 1e-6;  // the square of the sine of the angle between plane and face
  // Along the plane, straight away from a face, to where that face's coordinate is greater by 1.
  struct Way {
    Crossing to;  // 0 if the plane is parallel to the face
    float squared_length;
  };
  const Way& way_past(int face) {
    Way& way = way_[face];
    if ((known_ways_ >> face & 1) != 0) return way;
    known_ways_ |= 1U << face;
    way = Way{{}, 0};
    const Vec3& weight = tet_.weight[face];
    const double square = dot(weight, weight), turn = turned(face), along = square - turn * turn;
    if (along <= kParallel * square) return way;
    for (int i = 0; i < 4; ++i) way.to[i] = float((dot(weight, tet_.weight[i]) - turn * turned(i)) / along);
    way.squared_length = float(1 / (along * width_ * width_));
    return way;
  }
  // To where the plane cuts the edge between two corners, if it does.
  [[nodiscard]] std::optional<float> squared_distance_to_cut(const Crossing& c, int first, int second) const {
    const float a = to_plane_[first], b = to_plane_[second];
    if (!(a * b < 0)) return {};
    Crossing off = c;
    off[first] -= b / (b - a);
    off[second] -= a / (a - b);
    Vec3 samples{};
    const Vertex zero = tet_.corner[0].at;
    for (int i = 1; i < 4; ++i) {
      const Vertex at = tet_.corner[i].at;
      const auto part = double(off[i]);
      samples = {samples[0] + part * (at.x - zero.x), samples[1] + part * (at.y - zero.y), samples[2] + part * (at.z - zero.z)};
    }
    const Vec3 way = affine_.direction(samples);
    return float(dot(way, way) / (width_ * width_));
  }
  // How much a coordinate grows along the gradient, for one world unit.
  [[nodiscard]] double turned(int i) const { return dot(tet_.weight[i], tet_.gradient) * inverse_slope_; }
  [[nodiscard]] static float sum(const Crossing& c) { return (c[0] + c[1]) + (c[2] + c[3]); }
  [[nodiscard]] static bool is_inside(const Crossing& c) { return std::min(std::min(c[0], c[1]), std::min(c[2], c[3])) >= -kOutside; }

  const BisectionTet& tet_;
  const Affine& affine_;  // of the grid
  double inverse_slope_, width_;
  Crossing to_plane_, step_;  // by corner: its distance; how much its coordinate grows one width on that way
  std::array<Way, 4> way_;    // by face, the one opposite of the corner
  unsigned known_ways_ = 0;   // a bit for each
};

template <class T>
class CrossingMeasure {
 public:
  // field and domain must outlive it.
  CrossingMeasure(const Field<T>& field, const Affine& affine, const Domain& domain) : field_(field), affine_(affine), domain_(domain) {}

  // The larger of `known` and the largest distance of the crossings in a tetrahedron, whose corners lie in the box, to
  // patches of its diamond: to its own, or to the nearest place where the surface cuts an edge of the diamond, one at least;
  // no more than `width`, the diamond's. In world units. zero: of the values at the tetrahedron's corners.
  [[nodiscard]] double distance_to_patches(const BisectionTet& tet, Vertex centre, const Isosurface& surface, double zero,
                                           std::span<const Crossing> crossings, double known, double width) const {
    PatchPlane plane(tet, affine_, surface.value - zero, width);
    const double first = double(tet.corner[0].value) + zero;
    const bool has_patch =
        std::any_of(tet.corner.begin() + 1, tet.corner.end(), [&](const auto& c) { return surface.separates(first, double(c.value) + zero); });
    std::optional<Patches> patches;  // found if it is needed
    auto farthest = float(known / width * (known / width));
    for (const Crossing& c : crossings) {
      std::optional<float> square = has_patch ? plane.squared_distance_to_patch(c) : std::nullopt;
      if (!square) {
        if (!patches) patches.emplace(*this, tet, centre, surface, zero, width);
        const float off = plane.distance(c);
        square = float(patches->squared_distance(c, double(std::max(farthest, 4 * off * off))));
      }
      if (!(*square < 1)) return std::max(known, width);  // also where values are too far apart for floats
      farthest = std::max(farthest, *square);
    }
    return std::max(known, std::sqrt(double(farthest)) * width);
  }

 private:
  // Where a tetrahedron and its diamond have a surface, from the tetrahedron's corner 0, in the diamond's widths.
  class Patches {
   public:
    Patches(const CrossingMeasure& measure, const BisectionTet& tet, Vertex centre, const Isosurface& surface, double zero, double width)
        : measure_(measure), zero_(tet.corner[0].at), centre_(centre), surface_(surface), width_(width) {
      std::array<double, 4> values;
      for (int i = 0; i < 4; ++i) {
        corner_[i] = at(tet.corner[i].at);
        values[i] = double(tet.corner[i].value) + zero;
      }
      border_ = PatchBorder(PatchPolygon(corner_, values, surface));
    }

    // Of a crossing in the tetrahedron to the border of its patch; or to the nearest cut of an edge of the diamond, if it is
    // more than `enough`.
    [[nodiscard]] double squared_distance(const Crossing& c, double enough) {
      Vec3 p{};
      for (int i = 1; i < 4; ++i)
        for (int k = 0; k < 3; ++k) p[k] += double(c[i]) * corner_[i][k];
      double nearest = border_.squared_distance(p);
      if (nearest <= enough) return nearest;
      if (cuts_.empty()) find_cuts();
      for (const Vec3& cut : cuts_) {
        const Vec3 off = subtract(p, cut);
        nearest = std::min(nearest, dot(off, off));
      }
      return nearest;
    }

   private:
    [[nodiscard]] Vec3 at(Vertex v) const {
      return scaled(1 / width_, measure_.affine_.direction({double(v.x - zero_.x), double(v.y - zero_.y), double(v.z - zero_.z)}));
    }
    void find_cuts() {
      const Diamond d(centre_);
      const Domain& domain = measure_.domain_;
      for (const int edge : set_bits(Domain::edges(*d.row, domain.tets(d)))) {
        const auto [a, b] = edge_ends(edge, d.row->belt);
        const Vertex first = domain.clamp(d.vertex(a)), second = domain.clamp(d.vertex(b));
        const double low = measure_.field_.at(first), high = measure_.field_.at(second);
        if (surface_.separates(low, high)) cuts_.push_back(lerp(at(first), at(second), part_of(surface_.value, low, high)));
      }
    }
    const CrossingMeasure& measure_;
    Vertex zero_, centre_;
    const Isosurface& surface_;
    double width_;
    std::array<Vec3, 4> corner_;
    PatchBorder border_;
    std::vector<Vec3> cuts_;  // empty at first
  };

  const Field<T>& field_;
  Affine affine_;  // of the grid
  const Domain& domain_;
};

}  // namespace intervale
