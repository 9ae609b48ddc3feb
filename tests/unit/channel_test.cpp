#include "common/patch/channel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/ivm/every_range.h"
#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/parallel/all_cores.h"
#include "common/patch/channel_bounds.h"
#include "server/builder/value_builder.h"
#include "tests/support/channels.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

IntervalVolume some_volume(unsigned seed) {
  const std::array<testing::Dims, 4> boxes{{{9, 9, 9}, {9, 7, 5}, {17, 12, 6}, {2, 3, 2}}};
  IntervalVolume volume = testing::build(testing::trial_of_seed(seed, boxes));
  testing::set_channels(volume, seed);
  return volume;
}

TEST(Channel, NamesOfOtherArraysAndNoLabelsAreRefused) {
  for (const char* const name : {"temperature", "T (K)", "\u00e9"}) EXPECT_TRUE(is_channel_name(name)) << name;
  for (const char* const name : {"", "surface", "value", "range", "a\nb", "\xff"}) EXPECT_FALSE(is_channel_name(name));
  EXPECT_FALSE(is_channel_name(std::string(65, 'x')));
}

TEST(Channel, WhatCannotBeIsRefused) {
  const Channel good = some_volume(0).description().channels[0];
  EXPECT_TRUE(check_channels(std::vector{good}));
  const auto refuses = [&](auto&& change) {
    std::vector<Channel> channels{good};
    change(channels);
    return !check_channels(channels);
  };
  EXPECT_TRUE(refuses([](auto& all) { all.push_back(all[0]); })) << "one name twice";
  EXPECT_TRUE(refuses([](auto& all) { all[0].name = "value"; }));
  EXPECT_TRUE(refuses([](auto& all) { all[0].unit = "\n"; }));
  EXPECT_TRUE(refuses([](auto& all) { all[0].components.clear(); }));
  EXPECT_TRUE(refuses([](auto& all) { all[0].components.push_back(all[0].components[0]); })) << "two components";
  EXPECT_TRUE(refuses([](auto& all) { all[0].components[0].corners[3] = all[0].components[0].format.last + 1; }));
  EXPECT_TRUE(refuses([](auto& all) { all[0].components[0].format.step = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refuses([](auto& all) { all[0].components[0].format = format_of_table(SampleType::f64, {0, 1, 300}); })) << "a table";
  EXPECT_TRUE(refuses([](auto& all) {
    for (std::size_t i = 0; i < kMaxChannels; ++i) all.push_back({std::to_string(i), {}, all[0].components});
  }));
}

TEST(Channel, NoVectorIsLongerThanItsGreatestValue) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const std::vector<Channel> channels = some_volume(seed).description().channels;
    for (const Channel& channel : channels) {
      const auto [least, greatest] = bounds_of(channel);
      double squares = 0;
      for (const ChannelComponent& component : channel.components) {
        const double most = std::max(-component.format.least(), component.format.greatest());
        squares += most * most;
      }
      const ValueFormat& first = channel.components[0].format;
      EXPECT_EQ(least, channel.components.size() == 1 ? first.least() : 0);
      if (channel.components.size() == 1) {
        EXPECT_EQ(greatest, first.greatest());
      } else {
        EXPECT_NEAR(greatest, std::sqrt(squares), 1e-12 * greatest);
      }
    }
  }
}

TEST(Channel, AreFoundByName) {
  const std::vector<Channel> channels = some_volume(0).description().channels;
  const auto found = [&](const std::vector<std::string>& names) { return find_channels(channels, names); };
  EXPECT_EQ(*found({}), std::vector<std::size_t>{});
  EXPECT_EQ(*found({"place", "noise", "place"}), (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(*found({"place"}), std::vector<std::size_t>{1});
  const auto none = found({"noise", "no\nise"});
  ASSERT_FALSE(none);
  EXPECT_TRUE(none.error().usage);
  EXPECT_THAT(none.error().message, HasSubstr("it has noise, place"));
  EXPECT_EQ(none.error().message.find('\n'), std::string::npos);
}

TEST(Channel, ComeBackFromAFileOfOneRange) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const IntervalVolume volume = some_volume(seed);
    const std::vector<std::byte> bytes = encode_ivm(volume);
    EXPECT_EQ(bytes, encode_ivm(volume, on_all_cores));
    const auto decoded = decode_ivm(bytes, "made");
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->description().channels, volume.description().channels);
    EXPECT_EQ(encode_ivm(*decoded), bytes);
    IntervalVolume without = volume;
    ASSERT_TRUE(without.set_channels({}, {}));
    EXPECT_NE(decode_ivm(encode_ivm(without), "made")->description().content_hash, decoded->description().content_hash);
  }
}

TEST(Channel, ComeBackFromAFileOfEveryRange) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const testing::ValueField field = testing::random_value_field({9, 7, 5}, seed);
    Volume samples = field.volume;
    ValueVolume::Parts parts = build_value_volume(samples, field.format).take();
    auto built = build_channel(testing::places({9, 7, 5}), "place", {}, parts.set);
    ASSERT_TRUE(built);
    parts.description.channels.push_back(built->channel);
    parts.channel_keys.push_back(built->keys);
    const ValueVolume volume(std::move(parts));
    const auto decoded = decode_values(encode_values(volume), "made");
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->description().channels, volume.description().channels);
    EXPECT_EQ(encode_values(*decoded), encode_values(volume));
    EXPECT_TRUE(of_every_range(ValueVolume::Parts(decoded->parts())));
  }
}

TEST(Channel, EveryFlippedByteOfAFileIsFound) {
  const std::vector<std::byte> bytes = encode_ivm(some_volume(7));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::byte> damaged = bytes;
    damaged[i] ^= std::byte(1 << i % 8);
    EXPECT_FALSE(decode_ivm(damaged, "damaged")) << "byte " << i;
  }
}

TEST(Channel, ValuesWithoutAStepAreRefused) {
  const testing::Dims dims{5, 5, 5};
  std::mt19937_64 random(1);
  std::vector<double> f(125);
  for (double& v : f) v = std::ldexp(double(random() >> 12), int(random() % 600) - 300);
  const IntervalVolume volume = some_volume(0);
  const auto built = build_channel(testing::volume_of_type(SampleType::f64, dims, f), "wide", 0.0, volume.set());
  ASSERT_FALSE(built);
  EXPECT_TRUE(built.error().usage);
  EXPECT_THAT(built.error().message, HasSubstr("--channel-step"));
}

// A field that is linear in space is reproduced by linear interpolation: at each point it is the point's own place.
TEST(Channel, AreInterpolatedWhereEdgesAreCut) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const IntervalVolume volume = some_volume(seed);
    const auto channels = channels_of(volume, std::vector<std::size_t>{0, 1});
    for (const double percent : {0.0, 20.0}) {
      const auto extracted = extract(volume, {.error_percent = percent});
      ASSERT_TRUE(extracted);
      const Mesh mesh = extracted->front.mesh(serial, channels);
      ASSERT_EQ(mesh.channels.size(), 2u);
      ASSERT_EQ(mesh.channels[0].value.size(), mesh.points.size());
      const MeshArray<double>& place = mesh.channels[1].value;
      ASSERT_EQ(place.size(), 3 * mesh.points.size());
      for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        const Vec3 at = volume.description().grid.affine.point({place[3 * i], place[3 * i + 1], place[3 * i + 2]});
        for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(at[k], mesh.points[i][k], 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace intervale
