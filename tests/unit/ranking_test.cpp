#include "common/ivm/ranking.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "common/ivm/refinement.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/cameras.h"
#include "tests/support/needs.h"
#include "tests/support/parents.h"
#include "tests/support/ranks.h"
#include "tests/support/seeds.h"

namespace intervale {
namespace {

using testing::for_each_rank;
using testing::NaiveCamera;
using testing::random_ahead;
using testing::random_map;
using testing::Vector;

// Half of how far the surfaces can move in an update's diamond, from what is stored.
double object_error(const IntervalVolume& v, const Place& p) {
  const Grid& g = v.description().grid;
  const std::uint8_t code = testing::to_distance_of(v.relevant(), v, p.brick, p.supercube).code();
  const double h = std::exp2(scale_of_key(p.key)), widest = diamond_width(g) / 2 * h;
  if (code == 0 || v.error(p.index) == 0) return 0;
  if (code == 191) return widest;
  const double unit = std::min({g.affine.spacing()[0], g.affine.spacing()[1], g.affine.spacing()[2]}) / v.description().max_error;
  const double furthest = 64 * diamond_width(g) / 2;
  if (code == 255) return furthest;
  if (code > 191) return std::min(furthest, double(v.error(p.index)) * unit * std::exp2((code - 216) / 2.0));
  return std::min(widest, double(v.error(p.index)) * unit * std::exp2((code - 72) / 6.0));
}

// The box around all diamonds of a cube of supercubes, given by two opposite corners, as far as there are samples.
ScreenError::Region region_of(const IntervalVolume& v, SupercubeKey first, SupercubeKey last_of_all) {
  const Vertex last = v.domain().last();
  Vector low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  for (const SupercubeKey key : {first, last_of_all}) {
    for (Slot slot{0}; slot < kSlots; ++slot) {
      const Diamond d(centre_of(key, slot));
      const std::array<std::int32_t, 3> c{d.centre.x, d.centre.y, d.centre.z}, end{last.x, last.y, last.z};
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], std::clamp(double(c[i] - d.h), 0.0, double(end[i])));
        high[i] = std::max(high[i], std::clamp(double(c[i] + d.h), 0.0, double(end[i])));
      }
    }
  }
  ScreenError::Region region;
  for (int i = 0; i < 3; ++i) region.middle[i] = (low[i] + high[i]) / 2, region.reach[i] = (high[i] - low[i]) / 2;
  return region;
}

// What is around an update: its supercube, or its brick where that is far away.
ScreenError::Region region_around(const IntervalVolume& v, const ScreenError& view, const Place& p) {
  const ScreenError::Region brick = region_of(v, p.key & ~SupercubeKey(63), p.key | 63);
  return view.is_near(brick) ? region_of(v, p.key, p.key) : brick;
}

// Pixels of one world unit there.
double pixels_per_unit(const IntervalVolume& v, const ScreenError& view, const Place& p) { return view.pixels_per_unit(region_around(v, view, p)); }

bool meets(const IntervalVolume& v, const Diamond& d, const Box& roi) {
  const Grid& g = v.description().grid;
  const std::array<std::int32_t, 3> c{d.centre.x, d.centre.y, d.centre.z};
  for (int i = 0; i < 3; ++i) {
    const double low = std::max(0.0, (roi.min[i] - g.affine.origin()[i]) / g.affine.spacing()[i]),
                 high = std::min(g.dims[i] - 1.0, (roi.max[i] - g.affine.origin()[i]) / g.affine.spacing()[i]);
    if (low > high || c[i] - d.h > high || c[i] + d.h < low) return false;
  }
  return true;
}

class Ranks : public ::testing::TestWithParam<unsigned> {
 protected:
  IntervalVolume volume_ = testing::ranking_volume(GetParam());
  std::mt19937 random_{GetParam()};  // the seed is the test's number
};

TEST_P(Ranks, NoUpdateRanksAboveItsBrick) {
  for (int trial = 0; trial < 40; ++trial) {
    const Lod lod = testing::random_lod(volume_.description().grid, random_);
    const auto map = random_map(lod, volume_.description().grid, random_);
    const auto ahead = random_ahead(lod, volume_.description().grid, random_);
    const Ranking ranking(volume_, volume_.relevant(), lod, map ? &*map : nullptr, ahead ? &*ahead : nullptr);
    for_each_rank(volume_, ranking,
                  [&](const Place& p, Ranking::Rank rank) { ASSERT_GE(ranking.of_brick(p.brick).bound(), rank) << "trial " << trial; });
  }
}

TEST_P(Ranks, NoUpdateRanksAboveItsSupercube) {
  for (int trial = 0; trial < 40; ++trial) {
    const Lod lod = testing::random_lod(volume_.description().grid, random_);
    const auto map = random_map(lod, volume_.description().grid, random_);
    const auto ahead = random_ahead(lod, volume_.description().grid, random_);
    const Ranking ranking(volume_, volume_.relevant(), lod, map ? &*map : nullptr, ahead ? &*ahead : nullptr);
    for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) {
      const BrickNeeds needs = volume_.relevant().brick(p.brick);
      const BrickNeeds::Highest highest = needs.highest(testing::number_in_brick(volume_, p.brick, p.supercube));
      Ranking::Supercube supercube = ranking.of_brick(p.brick).rough(needs, p.supercube, p.key);
      const Ranking::Rank rough = supercube.bound(highest.error_step, 0, highest.slope);
      supercube.refine();
      const Ranking::Rank bound = supercube.bound(highest.error_step, 0, highest.slope);
      ASSERT_GE(bound, rank) << "trial " << trial;
      ASSERT_GE(rough, bound) << "trial " << trial;
    });
  }
}

TEST_P(Ranks, WhatADepthMapHidesComesLastAndIsWantedAllTheSame) {
  std::size_t hidden = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Lod lod = testing::random_lod(volume_.description().grid, random_);
    const Grid& g = volume_.description().grid;
    if (!lod.camera) lod.camera = testing::random_camera(g, random_);
    lod.camera->pixel_error = 1e-3;
    const auto map = random_map(lod, g, random_);
    if (!map) continue;
    const Ranking seen(volume_, lod), ranking(volume_, volume_.relevant(), lod, &*map);
    const Occlusion occlusion(*map, *lod.camera, g);
    std::array<std::optional<int>, 2> shifts;
    Ranking::Rank highest_hidden = 0, lowest_seen = std::numeric_limits<Ranking::Rank>::max();
    for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) {
      const Ranking::Rank without = testing::rank_of(volume_, seen, p);
      ASSERT_EQ(rank == 0, without == 0);
      if (rank == 0) return;
      const bool is_hidden = occlusion.hides(region_of(volume_, p.key, p.key));
      hidden += is_hidden;
      // Either kind is ranked as without a map.
      const int shift = int(rank) - int(without);
      ASSERT_EQ(shifts[is_hidden].value_or(shift), shift) << "trial " << trial;
      shifts[is_hidden] = shift;
      if (is_hidden) {
        highest_hidden = std::max(highest_hidden, rank);
      } else {
        lowest_seen = std::min(lowest_seen, rank);
      }
    });
    ASSERT_LT(highest_hidden, lowest_seen);
    if (highest_hidden != 0) {
      ASSERT_GT(ranking.band_below(lowest_seen, true), highest_hidden);
    }
  }
  if (GetParam() == 0) {
    EXPECT_GT(hidden, 0u);
  }
}

TEST_P(Ranks, WantedIsWhatTheNaiveModelWants) {
  std::size_t wanted = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Lod lod = testing::random_lod(volume_.description().grid, random_);
    const double threshold = error_of(lod, volume_.description().max_error);
    std::optional<ScreenError> view;
    if (lod.camera) view.emplace(*lod.camera, volume_.description().grid);
    const Ranking ranking(volume_, lod);
    for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) {
      bool expected = threshold == 0 || volume_.error(p.index) > threshold;
      if (lod.roi) expected = expected && meets(volume_, Diamond(SupercubeSet::centre(p)), *lod.roi);
      if (lod.camera && expected) {
        const double pixels = object_error(volume_, p) * pixels_per_unit(volume_, *view, p);
        if (std::abs(pixels - lod.camera->pixel_error) < 1e-5 * pixels) return;
        expected = pixels > lod.camera->pixel_error;
      }
      ASSERT_EQ(rank != 0, expected) << "trial " << trial;
      wanted += expected;
    });
  }
  EXPECT_GT(wanted, 100u);
}

// Of a range whose distances were measured by update: what moves too far is wanted, whatever its error, and bounds hold.
TEST_P(Ranks, WhereDistancesAreKnownTheyTellWhatIsWanted) {
  const Grid& g = volume_.description().grid;
  auto parts = testing::parts_of(volume_);
  for (UpdateIndex i{0}; i < volume_.size(); ++i) parts.surface.distances.push_back(std::uint8_t(random_() % 256));
  const IntervalVolume volume = IntervalVolume::assemble(std::move(parts)).value();
  for (int trial = 0; trial < 20; ++trial) {
    Lod lod;
    lod.camera = testing::random_camera(g, random_);
    lod.camera->pixel_error = std::pow(2.0, testing::uniform(random_, -8, 6));
    const ScreenError view(*lod.camera, g);
    const Ranking ranking(volume, lod);
    for_each_rank(volume, ranking, [&](const Place& p, Ranking::Rank rank) {
      const Ranking::Brick brick = ranking.of_brick(p.brick);
      const RelevantUpdates& relevant = volume.relevant();
      const BrickNeeds needs = relevant.brick(p.brick);
      const BrickNeeds::Highest highest = needs.highest(testing::number_in_brick(volume, p.brick, p.supercube));
      ASSERT_GE(brick.bound(), rank);
      ASSERT_GE(brick.supercube(needs, p.supercube, p.key).bound(highest.error_step, highest.distance, highest.slope), rank);
      const double pixels = double(distance_of(testing::distance_of(relevant, volume, p), diamond_width(g))) * pixels_per_unit(volume, view, p);
      if (std::abs(pixels - lod.camera->pixel_error) < 1e-5 * pixels) return;
      ASSERT_EQ(rank != 0, pixels > lod.camera->pixel_error) << "trial " << trial;
    });
  }
}

// What it is all for: no surface point in the picture is left further off than asked for, by any update that is not
// wanted.
TEST_P(Ranks, WhatIsNotWantedDoesNotShow) {
  const Grid& g = volume_.description().grid;
  for (int trial = 0; trial < 20; ++trial) {
    Lod lod;
    lod.camera = testing::random_camera(g, random_);
    lod.camera->pixel_error = std::pow(2.0, testing::uniform(random_, -1, 6));
    const NaiveCamera naive(*lod.camera);
    const Ranking ranking(volume_, lod);
    for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) {
      if (rank != 0) return;
      const Diamond d(SupercubeSet::centre(p));
      Vector at;
      const std::array<std::int32_t, 3> c{d.centre.x, d.centre.y, d.centre.z};
      for (int i = 0; i < 3; ++i) {
        const double sample = std::clamp(c[i] + d.h * testing::uniform(random_, -1, 1), 0.0, g.dims[i] - 1.0);
        at[i] = g.affine.origin()[i] + g.affine.spacing()[i] * sample;
      }
      if (!naive.shows(at) || naive.depth(at) < 1e-3 * g.affine.spacing()[0]) return;
      ASSERT_LE(object_error(volume_, p) * naive.pixels_per_unit(at), lod.camera->pixel_error * (1 + 1e-5)) << "trial " << trial;
    });
  }
}

// With slopes, and without.
TEST_P(Ranks, GrowWithTheSquaredDeviationInThePicture) {
  const Grid& g = volume_.description().grid;
  auto parts = testing::parts_of(volume_);
  parts.surface.slopes.clear();
  const IntervalVolume without = IntervalVolume::assemble(std::move(parts)).value();
  const double spacing = std::cbrt(g.affine.spacing()[0] * g.affine.spacing()[1] * g.affine.spacing()[2]);
  for (int trial = 0; trial < 20; ++trial) {
    Lod lod;
    lod.camera = testing::random_camera(g, random_);
    lod.camera->pixel_error = std::pow(2.0, testing::uniform(random_, -8, 3));
    const IntervalVolume& volume = trial % 2 == 0 ? volume_ : without;
    const ScreenError view(*lod.camera, g);
    const Ranking ranking(volume, lod);
    std::vector<std::pair<Ranking::Rank, double>> all;  // with what they stand for
    for_each_rank(volume, ranking, [&](const Place& p, Ranking::Rank rank) {
      if (rank == 0) return;
      const double a_unit = pixels_per_unit(volume_, view, p), pixels = object_error(volume_, p) * a_unit;
      ASSERT_LE(pixels, ranking.of_brick(p.brick).pixels(volume_.relevant().bound(p.brick).object_error) * (1 + 1e-5)) << "trial " << trial;
      const double a_step = spacing * a_unit, h = std::exp2(scale_of_key(p.key)) * a_step;
      const double removed = volume.relevant().has_slopes()
                                 ? removed_of(testing::slope_of(volume.relevant(), volume, p)) * std::pow(a_step, 3) * std::exp2(scale_of_key(p.key))
                                 : pixels * pixels * h * h;
      const double large = std::clamp(h / 12, 1.0, 16.0);
      all.emplace_back(rank, removed * large * large * large * view.seen_share(region_around(volume_, view, p)));
    });
    std::sort(all.begin(), all.end());
    for (std::size_t i = 1; i < all.size(); ++i) {
      const auto [lower, less] = all[i - 1];
      const auto [higher, more] = all[i];
      if (lower <= 1) continue;
      // A rank holds a sixteenth of an octave.
      ASSERT_GE(more, less / 1.07) << "trial " << trial;
      if (higher - lower > 1) {
        ASSERT_GT(more, less * (1 - 1e-5)) << "trial " << trial;
      }
    }
    // A band: from its top down to what it still takes.
    for (std::size_t i = 0; i < all.size(); i += 1 + all.size() / 20) {
      const Ranking::Rank top = all[i].first, low = ranking.band_below(top);
      ASSERT_GE(low, 1);
      ASSERT_LE(low, top);
      ASSERT_LE(ranking.band_below(top, true), all.front().first);
      ASSERT_LE(ranking.band_below(top, false, 2), low);
      ASSERT_GE(ranking.band_below(top, false, Ranking::kMostWidth), ranking.band_below(top, true));
      const auto last = std::lower_bound(all.begin(), all.end(), std::pair(low, 0.0));
      if (low > 1) {
        ASSERT_LE(all[i].second, last->second * 4 * 1.07) << "trial " << trial;
      }
    }
  }
}

TEST_P(Ranks, WithoutACameraErrorsAreThoseThatAreLeft) {
  for (int trial = 0; trial < 40; ++trial) {
    Lod lod = testing::random_lod(volume_.description().grid, random_);
    lod.camera.reset();
    const Ranking ranking(volume_, lod);
    EXPECT_EQ(ranking.error(0), 0);
    for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) {
      if (rank == 0) return;
      ASSERT_EQ(ranking.error(rank), double(volume_.error(p.index))) << "trial " << trial;
      const Ranking::Rank low = ranking.band_below(rank);
      ASSERT_GE(low, 1);
      ASSERT_LE(low, rank);
      ASSERT_LE(ranking.error(rank), ranking.error(low) * 4) << "trial " << trial;
      ASSERT_EQ(ranking.band_below(rank, true), 1);
    });
  }
}

// The narrowest of views show everything larger than any number.
TEST_P(Ranks, PixelsAreANumberWhateverTheCamera) {
  Lod lod;
  lod.camera = testing::random_camera(volume_.description().grid, random_);
  for (const double fov : {1e-306, 1e-100, 1e-37, 1e-30, 179.999999}) {
    for (const double pixel_error : {1e-300, 1.0, 1e300}) {
      lod.camera->fov = fov;
      lod.camera->pixel_error = pixel_error;
      ASSERT_TRUE(check_lod(lod));
      const Ranking ranking(volume_, lod);
      for (BrickIndex b{0}; b < volume_.set().bricks().size(); ++b) {
        ASSERT_TRUE(std::isfinite(ranking.of_brick(b).pixels(volume_.relevant().bound(b).object_error))) << "fov " << fov;
      }
      for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) { ASSERT_LE(rank, ranking.of_brick(p.brick).bound()); });
    }
  }
}

// What a camera wants, and the ancestors of that, and nothing else.
TEST_P(Ranks, SelectIsClosedUnderParentsAndMinimal) {
  for (int trial = 0; trial < 40; ++trial) {
    const Lod lod = testing::random_lod(volume_.description().grid, random_);
    const Ranking ranking(volume_, lod);
    SplitSet expected(volume_.set());
    for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) {
      if (rank != 0) expected.insert(p);
    });
    volume_.set().for_each_up([&](const Place& p) {
      if (!expected.contains(p)) return;
      testing::for_each_parent(volume_.set(), p, [&](UpdateIndex parent) { expected.insert(volume_.set().place(parent)); });
    });
    const SplitSet chosen = select(volume_, lod);
    ASSERT_EQ(chosen, expected) << "trial " << trial << ": " << chosen.count() << " chosen, " << expected.count() << " expected";
  }
}

TEST_P(Ranks, AFinerPictureChoosesNoLess) {
  for (int trial = 0; trial < 5; ++trial) {
    Lod lod;
    lod.camera = testing::random_camera(volume_.description().grid, random_);
    SplitSet coarser(volume_.set());
    for (const double pixels : {1e6, 100.0, 10.0, 3.0, 1.0, 0.1, 1e-300}) {
      lod.camera->pixel_error = pixels;
      const SplitSet chosen = select(volume_, lod);
      volume_.set().for_each_down(
          [&](const Place& p) { ASSERT_TRUE(chosen.contains(p) || !coarser.contains(p)) << "trial " << trial << ", " << pixels; });
      coarser = chosen;
    }
    // In the end all that moves anything, wherever it is.
    volume_.set().for_each_down([&](const Place& p) { ASSERT_TRUE(coarser.contains(p) || object_error(volume_, p) == 0); });
  }
}

TEST_P(Ranks, InOrderParentsComeFirstAndRanksDoNotAscend) {
  for (int trial = 0; trial < 10; ++trial) {
    const Lod lod = testing::random_lod(volume_.description().grid, random_);
    const Ranking ranking(volume_, lod);
    const SplitSet chosen = select(volume_, lod);
    const auto order = in_order(volume_, chosen, lod);
    ASSERT_EQ(order.size(), chosen.count());
    std::vector<Ranking::Rank> ranks(volume_.size());  // an ancestor's is that of what needs it
    for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) { ranks[p.index] = rank; });
    volume_.set().for_each_up([&](const Place& p) {
      if (!chosen.contains(p)) return;
      testing::for_each_parent(volume_.set(), p, [&](UpdateIndex parent) { ranks[parent] = std::max(ranks[parent], ranks[p.index]); });
    });
    SplitSet seen(volume_.set());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Place p = volume_.set().place(order[i]);
      ASSERT_TRUE(chosen.contains(p) && !seen.contains(p));
      testing::for_each_parent(volume_.set(), p,
                               [&](UpdateIndex parent) { ASSERT_TRUE(seen.contains(volume_.set().place(parent))) << "trial " << trial; });
      if (i > 0) {
        ASSERT_LE(ranks[order[i]], ranks[order[i - 1]]) << "trial " << trial;
      }
      seen.insert(p);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Random, Ranks, testing::seeds(0, 10));

}  // namespace
}  // namespace intervale
