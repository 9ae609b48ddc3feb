// Whether two interval volumes are equal.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "tests/support/needs.h"

namespace intervale::testing {

inline std::vector<std::uint8_t> codes_of(const IntervalVolume& v) {
  std::vector<std::uint8_t> codes;
  for (const ErrorToDistance c : error_to_distance_of(v.relevant(), v)) codes.push_back(c.code());
  return codes;
}

// But for what only a file has: a name and a hash.
inline void expect_equal(const IntervalVolume& a, const IntervalVolume& b) {
  Description described = b.description();
  described.name = a.description().name;
  described.content_hash = a.description().content_hash;
  EXPECT_EQ(a.description(), described);
  EXPECT_TRUE(std::ranges::equal(a.set().occupancy(), b.set().occupancy()));
  EXPECT_TRUE(std::ranges::equal(a.error_steps(), b.error_steps()));
  EXPECT_TRUE(std::ranges::equal(codes_of(a), codes_of(b)));
  EXPECT_EQ(a.relevant().has_slopes(), b.relevant().has_slopes());
  ASSERT_EQ(a.size(), b.size());
  a.set().for_each_down([&](const Place& p) {
    const auto q = b.set().find(a.set().centre(p));
    ASSERT_TRUE(q);
    EXPECT_EQ(a.key(p.index), b.key(q->index));
    EXPECT_EQ(a.error(p.index), b.error(q->index));
    EXPECT_EQ(slope_of(a.relevant(), a, p), slope_of(b.relevant(), b, *q));
  });
}

}  // namespace intervale::testing
