// What the tests of fronts share: a field by seed, ranges of it, and what must hold of a front's mesh.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/naive_volume.h"
#include "tests/support/value_fields.h"

namespace intervale::testing {

// On several threads, last piece first.
inline void on_threads(std::size_t count, const std::function<void(std::size_t)>& piece) {
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 3; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t i = count; i-- > 0;) {
        if (i % 3 == t) piece(i);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

inline Front::Handle handle_of(Vertex c) {
  const Diamond d(c);
  const int up = d.scale + 2;
  return {supercube_key(d.scale, {c.x >> up, c.y >> up, c.z >> up}), kSlotOfType[d.type]};
}

// The first point whose value is wrong, or an empty text.
inline std::string wrong_value(const Front& front, const ValueField& field, const Mesh& mesh) {
  if (mesh.value.size() != mesh.points.size()) return "not one value a point";
  const Grid& grid = field.volume.grid;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (mesh.surface[i] == Surface::alpha && mesh.value[i] != front.range().alpha) return "a value on alpha is not alpha";
    if (mesh.surface[i] == Surface::beta && mesh.value[i] != front.range().beta) return "a value on beta is not beta";
    if (mesh.surface[i] != Surface::inside) continue;
    std::array<std::int32_t, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = std::int32_t(std::lround((mesh.points[i][k] - grid.affine.origin()[k]) / grid.affine.spacing()[k]));
    if (mesh.value[i] != field.value({at[0], at[1], at[2]})) return "a value is not its sample's";
    if (side_of(mesh.value[i], front.range()) != Side::inside) return "a value is not within the range";
  }
  return {};
}

// Whether the mesh has the points that follow from the samples and from which splits are shown, and no others.
inline bool has_naive_points(const Front& front, const ValueField& field, const Mesh& mesh) {
  const auto is_shown = [&](Vertex c) { return (front.shown_slots(handle_of(c).supercube) >> handle_of(c).slot & 1) != 0; };
  return points_of(mesh, field.volume.grid) == naive_points(field.volume, front.range(), is_shown);
}

inline std::array<std::int32_t, 3> random_dims(unsigned seed) {
  std::mt19937 random(seed);
  const auto side = [&] { return std::int32_t(2 + random() % 9); };
  switch (seed % 4) {
    case 0:
      return {9, 9, 9};
    case 1:
      return {9, 7, 5};
    default:
      return {side(), side(), side()};
  }
}

class FrontLaws : public ::testing::TestWithParam<unsigned> {
 protected:
  [[nodiscard]] Range any_range() { return random_range(field, random); }
  [[nodiscard]] Refine any_refine() { return random() % 2 == 0 ? Refine::uniform : Refine::boundary; }

 public:
  ValueField field = random_value_field(random_dims(GetParam()), GetParam());
  std::mt19937 random{GetParam()};
};

}  // namespace intervale::testing
