#include "common/codec/value_prediction.h"

#include <gtest/gtest.h>

#include <random>

#include "common/codec/value_coder.h"

namespace intervale {
namespace {

// A centre of each class, and the keys at its vertices of a field that is linear in the coordinates.
struct PredictionCase {
  Diamond diamond;
  VertexKeys keys{};
  ValueKey centre;
};
PredictionCase linear_case(Vertex centre, const std::array<int, 3>& slope) {
  const auto key = [&](Vertex v) { return ValueKey(1000 + slope[0] * v.x + slope[1] * v.y + slope[2] * v.z); };
  PredictionCase made{Diamond(centre), {}, key(centre)};
  for (int v = 0; v < made.diamond.row->vertices; ++v) made.keys[std::size_t(v)] = key(made.diamond.vertex(v));
  return made;
}

TEST(ValuePrediction, IsExactForALinearField) {
  for (const Vertex centre : {Vertex{5, 3, 7}, Vertex{6, 3, 7}, Vertex{6, 4, 7}, Vertex{20, 12, 4}, Vertex{8, 12, 4}}) {
    for (const PredictorWeights& weights : {PredictorWeights{}, PredictorWeights{100, -50, 300}, PredictorWeights{-1024, 1024, 77}}) {
      const PredictionCase c = linear_case(centre, {7, -11, 5});
      EXPECT_EQ(predict(predictor_values(c.diamond.row->cls, c.keys), weights, 5000).key, c.centre);
    }
  }
}

TEST(ValuePrediction, StaysWithinTheKeys) {
  std::mt19937 random(3);
  for (int i = 0; i < 3000; ++i) {
    const ValueKey last = i % 3 == 0 ? ~ValueKey(0) - 1 : ValueKey(random() % 1000 + 1);
    VertexKeys keys{};
    for (ValueKey& key : keys) key = ValueKey(random() % (std::uint64_t(last) + 1));
    const PredictorWeights weights{std::int16_t(random()), std::int16_t(random()), std::int16_t(random())};
    EXPECT_LE(predict(predictor_values(i % 3, keys), weights, last).key, last);
  }
}

TEST(ValuePrediction, TellsTheQuarterOfAKey) {
  PredictorValues values;
  const std::pair<int, int> rounded[]{{99, 2}, {100, 3}, {103, 3}, {104, 0}, {107, 0}, {108, 1}, {111, 1}, {112, 2}};  // of sixteenths
  for (const auto& [spine, quarter] : rounded) {
    values.spine = spine;
    const Prediction prediction = predict(values, {}, 1000);
    EXPECT_EQ(prediction.key, ValueKey((spine + 8) / 16));
    EXPECT_EQ(prediction.quarter, quarter) << spine;
  }
}

TEST(ValuePrediction, TakesAMissingVertexForTheMeanOfTheSpine) {
  VertexKeys keys{10, 21, kNoKey, 5, kNoKey, 7};
  fill_missing(keys, 6);
  EXPECT_EQ(keys, (VertexKeys{10, 21, 15, 5, 15, 7}));
}

TEST(ValuePrediction, LevelsOfActivityAreHalfOctaves) {
  EXPECT_EQ(activity_level(0), 0);
  EXPECT_EQ(activity_level(~std::uint64_t(0) - 1), kActivityLevels - 1);
  for (std::uint64_t a = 0; a < 5000; ++a) {
    EXPECT_LE(activity_level(a), activity_level(a + 1));
    EXPECT_EQ(activity_level(2 * a + 1), std::min(activity_level(a) + 2, kActivityLevels - 1));
  }
}

TEST(SignedModel, GivesBackEveryNumber) {
  std::mt19937_64 random(5);
  std::vector<std::int64_t> numbers{0, 1, -1, 2, (std::int64_t(1) << 33) - 1, -((std::int64_t(1) << 33) - 1), 1 << 18, -(1 << 17)};
  for (int i = 0; i < 20000; ++i) {
    const auto size = std::int64_t(random() >> (31 + random() % 33));
    numbers.push_back(random() % 2 == 0 ? size : -size);
  }
  RangeEncoder encoder;
  SignedModel model;
  std::uint8_t quarter = 0;
  for (const std::int64_t number : numbers) EXPECT_EQ(model.code(encoder, number, quarter++ % 4), number);
  const auto bytes = encoder.finish();
  RangeDecoder decoder(bytes);
  model = {};
  quarter = 0;
  for (const std::int64_t number : numbers) ASSERT_EQ(model.code(decoder, 0, quarter++ % 4), number);
  EXPECT_TRUE(decoder.is_spent());
}

}  // namespace
}  // namespace intervale
