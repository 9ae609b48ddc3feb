#include "common/codec/residual_coder.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace intervale {
namespace {

struct Update {
  int cls = 0;
  unsigned side = 0, firsts = 0;
  std::vector<std::uint8_t> cuts;
};

// Noise: the worst that there is to code.
std::vector<Update> some_updates(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Update> updates(2000);
  for (Update& u : updates) {
    u.cls = int(random() % 3);
    u.side = unsigned(random() % 3);
    u.cuts.resize(random() % (kMaxCuts + 1));
    u.firsts = u.cuts.empty() ? 0 : u.cuts.size() > 10 || (u.cuts.size() > 1 && random() % 2 == 0) ? 2 : 1;
    for (auto& c : u.cuts) c = std::uint8_t(random());
  }
  return updates;
}

TEST(ResidualCoder, GivesBackWhatWasWrittenPlainOrNot) {
  for (const bool is_plain : {false, true}) {
    const auto updates = some_updates(1);
    RangeEncoder encoder;
    ResidualCoder to;
    to.is_plain = is_plain;
    std::size_t bytes = 0;
    for (Update u : updates) {
      to.code_side(encoder, u.side);
      to.code_cuts(encoder, u.cls, u.side, unsigned(u.cuts.size()), u.firsts, u.cuts.data());
      bytes += 1 + u.cuts.size();
    }
    const auto coded = encoder.finish();
    if (is_plain) {
      EXPECT_LE(coded.size(), bytes + 8);
    }
    RangeDecoder decoder(coded);
    ResidualCoder from;
    from.is_plain = is_plain;
    for (const Update& u : updates) {
      ASSERT_EQ(from.code_side(decoder), u.side);
      std::vector<std::uint8_t> cuts(u.cuts.size());
      from.code_cuts(decoder, u.cls, u.side, unsigned(cuts.size()), u.firsts, cuts.data());
      ASSERT_EQ(cuts, u.cuts);
    }
    EXPECT_TRUE(decoder.is_spent());
  }
}

}  // namespace
}  // namespace intervale
