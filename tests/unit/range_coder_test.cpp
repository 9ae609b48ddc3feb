#include "common/codec/range_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "common/codec/coding_rate.h"

namespace intervale {
namespace {

// Symbols of every kind, from a seed; which kind comes next depends on what came before.
template <class Coder>
std::vector<unsigned> code_all(Coder& coder, const std::vector<unsigned>& values) {
  std::vector<unsigned> got;
  BitModel flag;
  NumberModel<7> number;
  SmallNumberModel small;
  for (const unsigned v : values) {
    switch (got.empty() ? 0 : got.back() % 4) {
      case 0:
        got.push_back(unsigned(coder.bit(flag, (v & 1) != 0)));
        break;
      case 1:
        got.push_back(number.code(coder, v % 128));
        break;
      case 2:
        got.push_back(small.code(coder, v % 65535));
        break;
      default:
        got.push_back(coder.raw_bits(9, v % 512));
    }
  }
  return got;
}

std::vector<unsigned> some_values(unsigned seed, std::size_t count) {
  std::mt19937 random(seed);
  std::vector<unsigned> values(count);
  for (unsigned& v : values) v = unsigned(random()) >> random() % 32;
  return values;
}

// In a buffer of exactly its size, so that the address sanitizer sees every step beyond.
std::vector<unsigned> decode_exact(std::span<const std::uint8_t> bytes, std::size_t count, bool& spent) {
  const std::vector<std::uint8_t> exact(bytes.begin(), bytes.end());
  RangeDecoder decoder(exact);
  auto got = code_all(decoder, std::vector<unsigned>(count));
  spent = decoder.is_spent();
  EXPECT_FALSE(spent && decoder.is_overdrawn());
  return got;
}

TEST(RangeCoder, GivesBackWhatWasWritten) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    const auto values = some_values(seed, seed * 7);
    RangeEncoder encoder;
    const auto written = code_all(encoder, values);
    const auto bytes = encoder.finish();
    EXPECT_EQ(bytes.size() % 4, 0u);
    bool spent = false;
    EXPECT_EQ(decode_exact(bytes, values.size(), spent), written) << "seed " << seed;
    EXPECT_TRUE(spent) << "seed " << seed;
  }
}

TEST(RangeCoder, EvenBitsAreCodedLikeOthers) {
  std::mt19937 random(5);
  for (const double share : {0.0, 0.02, 0.5, 0.9, 1.0}) {
    std::bernoulli_distribution one(share);
    std::vector<bool> bits(3000);
    std::generate(bits.begin(), bits.end(), [&] { return one(random); });
    RangeEncoder others, evens;
    BitModel of_others, of_evens;
    for (const bool bit : bits) {
      others.bit(of_others, bit);
      evens.even_bit(of_evens, bit);
      ASSERT_EQ(of_evens.of_zero(), of_others.of_zero());
    }
    const auto bytes = others.finish();
    EXPECT_EQ(evens.finish(), bytes);
    RangeDecoder decoder(bytes);
    BitModel model;
    for (const bool bit : bits) ASSERT_EQ(decoder.even_bit(model), bit);
    EXPECT_TRUE(decoder.is_spent());
  }
}

TEST(RangeCoder, EverySmallNumberComesBack) {
  RangeEncoder encoder;
  {
    SmallNumberModel small;
    for (unsigned v = 0; v < 65535; ++v) small.code(encoder, v);
  }
  const auto bytes = encoder.finish();
  RangeDecoder decoder(bytes);
  SmallNumberModel small;
  for (unsigned v = 0; v < 65535; ++v) ASSERT_EQ(small.code(decoder), v);
  EXPECT_TRUE(decoder.is_spent());
}

// Long runs of one value, then the other: the largest carries, and chances at their ends.
TEST(RangeCoder, RunsComeBackAndCostNextToNothing) {
  for (const bool first : {false, true}) {
    RangeEncoder encoder;
    BitModel chance;
    for (int i = 0; i < 100000; ++i) encoder.bit(chance, first != (i % 10000 == 9999));
    const auto bytes = encoder.finish();
    EXPECT_LT(bytes.size(), 60u);
    RangeDecoder decoder(bytes);
    BitModel again;
    for (int i = 0; i < 100000; ++i) ASSERT_EQ(decoder.bit(again), first != (i % 10000 == 9999));
    EXPECT_TRUE(decoder.is_spent());
  }
}

TEST(RangeCoder, BitsCostWhatTheirChancesCallFor) {
  std::mt19937 random(1);
  RangeEncoder encoder;
  BitModel chance;
  const int count = 200000;
  for (int i = 0; i < count; ++i) encoder.bit(chance, random() % 10 == 0);
  const double entropy = -(0.1 * std::log2(0.1) + 0.9 * std::log2(0.9)) * count / 8;
  EXPECT_LT(double(encoder.finish().size()), entropy * 1.03);
}

TEST(RangeCoder, BytesBehindTheEndAreNoticed) {
  const auto values = some_values(5, 300);
  RangeEncoder encoder;
  code_all(encoder, values);
  auto bytes = encoder.finish();
  bool spent = false;
  for (std::size_t n = 0; n < bytes.size(); ++n) decode_exact(std::span(bytes).first(n), values.size(), spent);
  bytes.resize(bytes.size() + 4);
  decode_exact(bytes, values.size(), spent);
  EXPECT_FALSE(spent);
}

// What a batch may take at most rests on this.
TEST(RangeCoder, EvenBitsTakeTheirOwnRoom) {
  std::mt19937 random(2);
  RangeEncoder encoder;
  for (int i = 0; i < 100000; ++i) encoder.raw_bits(8, i % 3 == 0 ? 255 : unsigned(random() % 256));
  EXPECT_LE(encoder.finish().size(), 100008u);
}

TEST(RangeCoder, AnyBytesGiveBits) {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::uint8_t> bytes(random() % 60);
    for (auto& b : bytes) b = round % 3 == 0 ? 0xff : std::uint8_t(random());
    bool spent = false;
    EXPECT_EQ(decode_exact(bytes, 400, spent).size(), 400u);
  }
}

// What most_coded_bits() says is nearly reached, and never exceeded.
TEST(RangeCoder, HoldsNoMoreBitsThanItsBestRate) {
  for (const bool bit : {false, true}) {
    for (const std::size_t count : {0u, 1u, 100u, 20'000u, 3'000'000u}) {
      RangeEncoder coder;
      BitModel model;
      for (std::size_t i = 0; i < count; ++i) coder.bit(model, bit);
      const std::size_t bytes = coder.finish().size();
      EXPECT_LE(count, most_coded_bits(bytes));
      EXPECT_TRUE(count < 1'000'000 || double(count) >= 0.95 * double(most_coded_bits(bytes))) << bytes;
      EXPECT_GE(std::min(model.of_zero(), 65536 - model.of_zero()), kLeastProbability);
    }
  }
}

}  // namespace
}  // namespace intervale
