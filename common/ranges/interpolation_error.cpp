#include "common/ranges/interpolation_error.h"

#include <cassert>

#include "common/util/tetrahedron.h"
#include "common/util/vec3.h"

namespace intervale {
namespace {

using Int3 = std::array<int, 3>;

TetPlan plan_of(const DiamondType& row, int tet) {
  std::array<Int3, 4> p{};
  const auto local = row.tet(tet);
  for (int i = 0; i < 4; ++i) p[i] = {row.vertex[local[i]].x, row.vertex[local[i]].y, row.vertex[local[i]].z};
  TetPlan plan;
  // The rows of the inverse of (p0, p2, p3) are gradients: the spine's middle is the origin.
  const int det = triple_product(p[2], p[3], p[0]);
  const std::array<Int3, 3> dual{cross(p[2], p[3]), cross(p[3], p[0]), cross(p[0], p[2])};
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 3; ++i) plan.gradient[axis][i] = double(dual[i][axis]) / det;
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const Int3& q : p) {
      plan.low[axis] = std::int8_t(std::min<int>(plan.low[axis], q[axis]));
      plan.high[axis] = std::int8_t(std::max<int>(plan.high[axis], q[axis]));
    }
  }
  std::array<TetPlan::Face, 4> faces{};
  for (int i = 0; i < 4; ++i) {
    const Int3 &a = p[kTetFaces[i][0]], &b = p[kTetFaces[i][1]], &c = p[kTetFaces[i][2]];
    Int3 n = cross(subtract(b, a), subtract(c, a));
    const int g = std::gcd(std::gcd(n[0], n[1]), n[2]), sign = dot(n, subtract(p[i], a)) < 0 ? -g : g;
    for (int& v : n) v /= sign;
    for (int k = 0; k < 3; ++k) {
      assert(n[k] >= -1 && n[k] <= 1 && "faces of diamonds are along axes and diagonals");
      faces[i].n[k] = std::int8_t(n[k]);
    }
    faces[i].d = std::int8_t(-dot(n, a));
    // The face opposite belt i + 1 contains belt i and belongs to the tetrahedron before. The last tetrahedron leaves
    // its other face to the first.
    faces[i].open = (i == 3 && tet > 0) || (i == 2 && tet == row.tets - 1);
  }
  int next = 0;
  const auto take = [&](auto&& which) {
    for (const TetPlan::Face& f : faces) {
      if (which(f.n[0])) plan.face[next++] = f;
    }
    return next;
  };
  plan.lower = take([](int x) { return x > 0; });
  plan.upper = take([](int x) { return x < 0; }) - plan.lower;
  take([](int x) { return x == 0; });
  return plan;
}

}  // namespace

const std::array<std::array<TetPlan, kMaxTets>, 64>& tet_plans() {
  static const auto plans = [] {
    std::array<std::array<TetPlan, kMaxTets>, 64> all{};
    for (unsigned type = 0; type < 64; ++type) {
      for (int i = 0; i < diamond_type(type).tets; ++i) all[type][i] = plan_of(diamond_type(type), i);
    }
    return all;
  }();
  return plans;
}

}  // namespace intervale
