// Random data sets to rank the updates of.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <random>

#include "common/ivm/ranking.h"
#include "common/view/depth_map.h"
#include "tests/support/cameras.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/parts.h"

namespace intervale::testing {

inline constexpr std::array<Dims, 5> kRankingBoxes{{{17, 17, 17}, {24, 17, 20}, {12, 5, 7}, {40, 9, 20}, {30, 2, 11}}};

inline IntervalVolume ranking_volume(unsigned seed) {
  const auto trial = trial_of_seed(seed, kRankingBoxes);
  return build(seed % 3 != 0 ? stretched(trial.volume) : trial.volume, trial.options);
}

// What a camera sees of some triangles in the box; none without a camera, and now and then.
inline std::optional<DepthMap> random_map(const Lod& lod, const Grid& g, std::mt19937& random) {
  if (!lod.camera || random() % 3 == 0) return {};
  DepthBuffer buffer(*lod.camera);
  for (int i = 0; i < 20; ++i) {
    std::array<Vec3, 3> triangle;
    for (Vec3& corner : triangle) {
      for (std::size_t k = 0; k < 3; ++k) corner[k] = uniform(random, -0.5, 1.5) * g.dims[k];
      corner = g.affine.point(corner);
    }
    buffer.draw(triangle);
  }
  return buffer.map();
}

// Where the camera goes; nowhere now and then.
inline std::optional<Camera> random_ahead(const Lod& lod, const Grid& g, std::mt19937& random) {
  if (!lod.camera || random() % 3 == 0) return {};
  return random_camera(g, random);
}

// Of one update that is relevant to the volume's range.
inline Ranking::Rank rank_of(const IntervalVolume& v, const Ranking& ranking, const Place& p) {
  const BrickNeeds needs = v.relevant().brick(p.brick);
  return ranking.of_brick(p.brick).supercube(needs, p.supercube, p.key)(p.index, p.slot);
}

// Of all that are.
using VisitRank = std::function<void(const Place&, Ranking::Rank)>;
inline void for_each_rank(const IntervalVolume& v, const Ranking& ranking, const VisitRank& visit) {
  v.set().for_each_down([&](const Place& p) {
    if (is_relevant(v.relevant(), v, p)) visit(p, rank_of(v, ranking, p));
  });
}

}  // namespace intervale::testing
