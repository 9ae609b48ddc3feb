#include "client/view/cross_section.h"

#include <algorithm>
#include <cmath>

namespace intervale {
namespace {

using Tet = FrontPatches::Tet;
using Vector = std::array<double, 3>;

Vector between(const Vector& a, const Vector& b, double t) { return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])}; }

bool faces(const Vector& a, const Vector& b, const Vector& c, const Vector& normal) {
  const Vector u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  return normal[0] * (u[1] * v[2] - u[2] * v[1]) + normal[1] * (u[2] * v[0] - u[0] * v[2]) + normal[2] * (u[0] * v[1] - u[1] * v[0]) >= 0;
}

class Cutter {
 public:
  Cutter(const Skin& skin, const CutPlane& plane) : skin_(skin) {
    const Grid& grid = skin.patches().grid();
    offset_ = plane.offset;
    for (int i = 0; i < 3; ++i) {
      normal_[i] = plane.normal[i] * grid.spacing[i];
      offset_ -= plane.normal[i] * grid.origin[i];
    }
  }

  std::vector<SectionVertex> run() {
    std::vector<Tet> tets;
    for (std::size_t number = 0; number < skin_.patches().supercubes(); ++number) {
      if (!may_meet(number)) continue;
      tets.clear();
      skin_.patches().emit(number, FrontPatches::Themselves{}, tets);
      level_ = std::uint8_t(skin_.patches().scale(number));
      for (const Tet& tet : tets) cut(tet);
    }
    return std::move(out_);
  }

 private:
  // Its diamonds reach from h before its corner to 4 h behind. What the corners of the domain leave is everywhere.
  [[nodiscard]] bool may_meet(std::size_t number) const {
    const int scale = skin_.patches().scale(number);
    if (scale == skin_.patches().domain().levels()) return true;
    const double h = double(std::int32_t(1) << scale);
    const Vertex p = skin_.patches().position(number);
    const Vector low{(4.0 * p.x - 1) * h, (4.0 * p.y - 1) * h, (4.0 * p.z - 1) * h};
    double middle = -offset_, reach = 0;
    for (int i = 0; i < 3; ++i) {
      middle += normal_[i] * (low[i] + 2.5 * h);
      reach += std::abs(normal_[i]) * 2.5 * h;
    }
    return std::abs(middle) <= reach;
  }

  void cut(const Tet& tet) {
    std::array<Vector, 4> p;
    std::array<double, 4> distance;
    std::array<int, 4> kept, gone;
    int keeps = 0, goes = 0;
    for (int k = 0; k < 4; ++k) {
      const auto& at = skin_.position(tet[k]);
      distance[k] = -offset_;
      for (int i = 0; i < 3; ++i) {
        p[k][i] = at[i] * (1.0 / FrontPatches::kSteps);
        distance[k] += normal_[i] * p[k][i];
      }
      if (distance[k] > 0) {
        gone[goes++] = k;
      } else {
        kept[keeps++] = k;
      }
    }
    if (keeps == 0 || goes == 0) return;
    const auto on = [&](int a, int b) { return between(p[a], p[b], distance[a] / (distance[a] - distance[b])); };
    if (keeps == 2) {
      const Vector a = on(kept[0], gone[0]), b = on(kept[0], gone[1]), c = on(kept[1], gone[1]), d = on(kept[1], gone[0]);
      add({a, b, c}, {{{255, 255, 0}, {0, 255, 0}, {0, 255, 255}}});
      add({a, c, d}, {{{255, 0, 255}, {0, 0, 255}, {0, 255, 255}}});
    } else {
      const int apex = keeps == 1 ? kept[0] : gone[0];
      const auto& rest = keeps == 1 ? gone : kept;
      add({on(apex, rest[0]), on(apex, rest[1]), on(apex, rest[2])}, {{{255, 0, 0}, {0, 255, 0}, {0, 0, 255}}});
    }
  }

  void add(const std::array<Vector, 3>& corner, const std::array<std::array<std::uint8_t, 3>, 3>& side) {
    const bool right = faces(corner[0], corner[1], corner[2], normal_);
    for (const int k : right ? std::array{0, 1, 2} : std::array{0, 2, 1}) {
      out_.push_back({float(corner[k][0]), float(corner[k][1]), float(corner[k][2]), side[k], level_});
    }
  }

  const Skin& skin_;
  Vector normal_;  // so that its product with a place in samples is the distance in world units
  double offset_ = 0;
  std::uint8_t level_ = 0;
  std::vector<SectionVertex> out_;
};

}  // namespace

std::vector<SectionVertex> cross_section(const Skin& skin, const CutPlane& plane) { return Cutter(skin, plane).run(); }

}  // namespace intervale
