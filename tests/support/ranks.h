// Random data sets to rank the updates of.
#pragma once

#include <array>
#include <functional>

#include "common/ivm/ranking.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/parts.h"

namespace intervale::testing {

inline constexpr std::array<Dims, 5> kRankingBoxes{{{17, 17, 17}, {24, 17, 20}, {12, 5, 7}, {40, 9, 20}, {30, 2, 11}}};

inline IntervalVolume ranking_volume(unsigned seed) {
  const auto trial = trial_of_seed(seed, kRankingBoxes);
  return build(seed % 3 != 0 ? stretched(trial.volume) : trial.volume, trial.options);
}

using VisitRank = std::function<void(const Place&, Ranking::Rank)>;
inline void for_each_rank(const IntervalVolume& v, const Ranking& ranking, const VisitRank& visit) {
  v.set().for_each_down([&](const Place& p) { visit(p, ranking.of_brick(p.brick).supercube(p.supercube, p.key)(p.index, p.slot)); });
}

}  // namespace intervale::testing
