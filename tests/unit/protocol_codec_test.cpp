#include "protocol/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>

#include "tests/support/special_values.h"

namespace intervale::protocol {
namespace {

using Bytes = std::vector<std::uint8_t>;

Description some_description() {
  Description d;
  d.name = "buckyball";
  d.grid = {{129, 65, 2}, Affine{{1, 0.5, -0.25, -1, 0, 2, 0.125, 0, -3, 0, 4, 1e9}}};
  d.labels = {"mm", "density \u00e9", "g/cm\u00b3", "LPS"};
  d.range = {-kInf, 188};
  d.refine = Refine::uniform;
  d.max_error = 12.25;
  d.updates = 123456789012;
  d.coefficients = 99;
  d.full = {1u << 31, 1ull << 40};
  d.content_hash = 0xfedcba9876543210;
  d.format = {SampleType::f32, 0.25, -1234567890123, 0xfffffffe};
  d.is_exact = false;
  for (ValueKey v = 0; v < kRootVertices; ++v) d.corners[v] = v * v * 0x01020304;
  std::int16_t weight = -32768;
  for (auto& scale : std::span(d.weights.of).first(7)) {  // of 129 samples
    for (auto& cls : scale) {
      for (auto& of : cls) of = weight = std::int16_t(weight + 911);
    }
  }
  return d;
}

Description described_by_table() {
  Description d = some_description();
  d.format = format_of_table(SampleType::f64, {-1e300, 0, 5e-324, 1, 1e300});
  for (ValueKey& key : d.corners) key %= 5;
  return d;
}

Description with_channels() {
  Description d = some_description();
  const auto component = [&](SampleType type, double step, std::int64_t first, ValueKey last) {
    ChannelComponent c{{type, step, first, last}, last % 2 == 0, {}, d.weights};
    c.corners.fill(last / 3);
    return c;
  };
  d.channels = {{"temperature", "K", {component(SampleType::f32, 0.5, -7, 1000)}},
                {"velocity", "", std::vector(3, component(SampleType::i16, 1, -32768, 65535))}};
  return d;
}

std::vector<ClientMessage> client_messages() {
  return {Open{"buckyball", "test 1", 262144},
          View{1, {}},
          View{2, {}, 12345, {{{}, {}, supercube_key(3, {1, 0, 2}), 5}, {{}, {}, supercube_key(0, {7, 8, 9}), 1}}},
          View{std::numeric_limits<std::uint64_t>::max(),
               {.error = 0.5, .error_percent = 10, .roi = Box{{-1, 0, 1}, {2, 0, 3}}, .max_updates = 1ull << 60}},
          View{3, {}, {}, {}, {{{-1.5, std::numeric_limits<double>::infinity()}}, {}}},
          View{4, {}, {}, {}, {{{2, 2}}, Refine::uniform}},
          View{7, {}, {}, {}, {{{2, 2}, {0, 1}, {2, 2}, {-1, 5}}, Refine::boundary}},
          View{6, {}, {}, {}, {{}, Refine::boundary}},
          View{8, {}, {}, {}, {{{2, 2}}, {}}, true, 12.5},
          View{9, {}, {}, {}, {}, false, 0.0},
          View{10, {}, {}, {}, {}, true, {}, {"temperature", "velocity"}},
          View{5, {.camera = Camera{.eye = {1, 2, 3}, .up = {0, 0, 1}, .fov = 30, .viewport = {640, 480}, .pixel_error = 2}}},
          Credit{65536},
          Open{"buckyball", "test 1", 0, 0xfedcba9876543210u},
          Open{.dataset = "buckyball", .payload = 0},
          Open{.dataset = "buckyball", .payload = 0xffffffff},
          Have{},
          Have{{{{}, {}, supercube_key(5, {1, 2, 3}), 1}}, 15},
          Have{{{{}, {}, supercube_key(5, {1, 2, 3}), 1}, {{}, {}, supercube_key(0, {4, 0, 9}), (std::uint64_t(1) << kSlots) - 1}}}};
}

std::vector<ServerMessage> server_messages() {
  return {Opened{some_description(), {}},
          Opened{described_by_table(), {}},
          Opened{with_channels(), {}},
          Batch{1, 2, 3, 4.5, 5.5, 6, {7, 8, 9}},
          Batch{},
          Batch{1, 2, 0, 4.5, 5.5, 6, {}, {7, 8, 9}},
          Done{1, 22, true},
          Fault{CloseCode::too_large, "too large"}};
}

Result<ClientMessage> decode(const ClientMessage&, std::span<const std::uint8_t> bytes) { return decode_client_message(bytes); }
Result<ServerMessage> decode(const ServerMessage&, std::span<const std::uint8_t> bytes) { return decode_server_message(bytes); }

// Bytes in a buffer of exactly their size, so that the address sanitizer sees every step beyond.
template <class Message>
auto decode_exact(const Message& kind, std::span<const std::uint8_t> bytes) {
  const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), exact.get());
  return decode(kind, {exact.get(), bytes.size()});
}

template <class Action>
void for_each_message(Action action) {
  for (const auto& message : client_messages()) action(message);
  for (const auto& message : server_messages()) action(message);
}

TEST(Codec, EveryMessageComesBackTheSame) {
  for_each_message([](const auto& message) {
    const auto back = decode_exact(message, encode(message));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, message);
  });
}

TEST(Codec, TheExampleInTheSpecificationIsTrue) {
  const Bytes example{0x10, 0, 0, 0, 0, 0, 0, 0, 8,    0, 0x0e, 0, 7, 0, 8, 0, 8, 0, 0, 0, 0, 0, 0, 3,
                      0x0c, 0, 0, 0, 0, 0, 6, 0, 0x0c, 0, 4,    0, 6, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0};
  EXPECT_EQ(encode(ClientMessage(Credit{65536})), example);
}

TEST(Codec, EveryAlignmentIsRead) {
  for_each_message([](const auto& message) {
    const Bytes bytes = encode(message);
    for (std::size_t shift = 0; shift < 8; ++shift) {
      Bytes shifted(shift);
      shifted.insert(shifted.end(), bytes.begin(), bytes.end());
      const auto back = decode(message, std::span(shifted).subspan(shift));
      ASSERT_TRUE(back);
      EXPECT_EQ(*back, message);
    }
  });
}

TEST(Codec, NoTruncatedMessageCrashes) {
  for_each_message([](const auto& message) {
    const Bytes bytes = encode(message);
    EXPECT_FALSE(decode_exact(message, {}));
    for (std::size_t size = 0; size < bytes.size(); ++size) (void)decode_exact(message, std::span(bytes).first(size));
  });
}

TEST(Codec, NoChangedByteCrashes) {
  for_each_message([](const auto& message) {
    const Bytes bytes = encode(message);
    for (std::size_t at = 0; at < bytes.size(); ++at) {
      for (const int change : {0x01, 0x80, 0xff}) {
        Bytes changed = bytes;
        changed[at] ^= static_cast<std::uint8_t>(change);
        (void)decode_exact(message, changed);
      }
    }
  });
}

TEST(Codec, NoiseIsRefused) {
  const unsigned seed = 20240607;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (int round = 0; round < 20000; ++round) {
    Bytes noise(random() % 200);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    EXPECT_FALSE(decode_exact(ClientMessage{}, noise));
    EXPECT_FALSE(decode_exact(ServerMessage{}, noise));
  }
}

TEST(Codec, OneSidesMessagesAreNotTheOthers) {
  EXPECT_FALSE(decode_server_message(encode(ClientMessage(Open{"x", "y", 1}))));                    // Opened holds a description there
  EXPECT_FALSE(decode_client_message(encode(ServerMessage(Fault{CloseCode::malformed, "text"}))));  // a kind that clients have not
}

TEST(Codec, LimitsHold) {
  EXPECT_TRUE(decode_client_message(encode(ClientMessage(Open{std::string(kMaxName, 'x'), "", 0}))));
  EXPECT_FALSE(decode_client_message(encode(ClientMessage(Open{std::string(kMaxName + 1, 'x'), "", 0}))));
  EXPECT_FALSE(decode_client_message(encode(ClientMessage(Open{"x", std::string(kMaxText + 1, 'x'), 0}))));
  Opened opened{some_description(), {}};
  opened.description.name.resize(kMaxName + 1, 'x');
  EXPECT_FALSE(decode_server_message(encode(ServerMessage(opened))));
  EXPECT_TRUE(decode_server_message(encode(ServerMessage(Batch{1, 0, 1, 0, 0, 0, Bytes(kMaxBatchPayload)}))));
  EXPECT_FALSE(decode_server_message(encode(ServerMessage(Batch{1, 0, 1, 0, 0, 0, Bytes(kMaxBatchPayload + 1)}))));
  EXPECT_FALSE(decode_server_message(encode(ServerMessage(Batch{1, 0, 1, kNan, 0, 0, {}}))));
  EXPECT_FALSE(decode_server_message(encode(ServerMessage(Batch{1, 0, 1, 0, kNan, 0, {}}))));
}

std::size_t offset_at(const Bytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}
// The place of a field of the table at `table`; 0: it is not there. slot: the field's number in stream.fbs, from 0.
std::size_t field(const Bytes& bytes, std::size_t table, std::size_t slot) {
  std::int32_t back = 0;
  std::memcpy(&back, bytes.data() + table, sizeof back);
  const std::size_t vtable = std::size_t(std::int64_t(table) - back);
  std::uint16_t offset = 0;
  std::memcpy(&offset, bytes.data() + vtable + 4 + 2 * slot, sizeof offset);
  return offset == 0 ? 0 : table + offset;
}
std::size_t target(const Bytes& bytes, std::size_t at) { return at + offset_at(bytes, at); }
// The place of a field of an Opened's description.
std::size_t described(const Bytes& bytes, std::size_t slot) {
  const std::size_t opened = target(bytes, field(bytes, target(bytes, 0), 1));
  return field(bytes, target(bytes, field(bytes, opened, 0)), slot);
}
constexpr std::size_t kType = 14, kLast = 17, kCorners = 19, kWeights = 20;  // slots of the description

TEST(Codec, ADescriptionHasTheCornersAndWeightsOfItsGrid) {
  const Bytes good = encode(ServerMessage(Opened{some_description(), {}}));
  ASSERT_EQ(offset_at(good, target(good, described(good, kCorners))), 8u);
  ASSERT_EQ(offset_at(good, target(good, described(good, kWeights))), 7u * 9);
  const auto refused = [&good](std::size_t at, std::uint32_t value, std::size_t size) {
    Bytes bytes = good;
    std::memcpy(bytes.data() + at, &value, size);
    return !decode_exact(ServerMessage{}, bytes);
  };
  for (const std::uint32_t count : {0u, 1u, 7u}) EXPECT_TRUE(refused(target(good, described(good, kCorners)), count, 4)) << count;
  for (const std::uint32_t count : {0u, 1u, 7u * 9 - 1, 8u * 9}) EXPECT_TRUE(refused(target(good, described(good, kWeights)), count, 4)) << count;
  EXPECT_TRUE(refused(described(good, kType), 8, 1)) << "no type of samples";
  EXPECT_FALSE(refused(described(good, kType), 7, 1));
}

TEST(Codec, ATableOfValuesHasTheSizeOfItsFormatAndFitsAMessage) {
  const Bytes good = encode(ServerMessage(Opened{described_by_table(), {}}));
  const auto refused = [&good](std::size_t slot, std::uint32_t value) {
    Bytes bytes = good;
    std::memcpy(bytes.data() + described(bytes, slot), &value, sizeof value);
    return !decode_exact(ServerMessage{}, bytes);
  };
  for (const std::uint32_t last : {0u, 3u, 5u, 0xfffffffeu, 0xffffffffu}) EXPECT_TRUE(refused(kLast, last)) << last;
  EXPECT_FALSE(refused(kLast, 4));
  Opened opened{described_by_table(), {}};
  opened.description.format.table = nullptr;
  EXPECT_FALSE(decode_exact(ServerMessage{}, encode(ServerMessage(opened))));
  std::mt19937_64 random(5);
  const auto noise_of = [&random](std::size_t count) {
    std::vector<double> values(count);
    for (double& v : values) v = double(random()) * 1e-30;
    std::sort(values.begin(), values.end());
    return format_of_table(SampleType::f64, values);
  };
  std::size_t fitting = 0;
  for (std::size_t count = 12000; count < 24000; count += 500) {
    opened.description.format = noise_of(count);
    const auto fits = check_sendable(opened.description);
    const auto back = decode_exact(ServerMessage{}, encode(ServerMessage(opened)));
    ASSERT_EQ(fits.has_value(), back.has_value());
    if (!fits) continue;
    ++fitting;
    EXPECT_EQ(std::get<Opened>(*back).description.format, opened.description.format);
    EXPECT_LE(encode(ServerMessage(opened)).size(), kMaxServerMessage);
  }
  EXPECT_TRUE(fitting > 0 && fitting < 24);
}

TEST(Codec, ADescriptionOfAnotherVersionKeepsWhatBothHave) {
  Opened opened{some_description(), {}};
  for (const std::uint32_t version : {0u, 1u, 2u, 3u, 5u}) {
    opened.payload = version;
    Bytes bytes = encode(ServerMessage(opened));
    const std::uint32_t none = 0;
    std::memcpy(bytes.data() + target(bytes, described(bytes, kCorners)), &none, sizeof none);
    const auto back = decode_exact(ServerMessage{}, bytes);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(std::get<Opened>(*back).payload, version);
    EXPECT_EQ(std::get<Opened>(*back).description.name, opened.description.name);
    EXPECT_EQ(std::get<Opened>(*back).description.format, ValueFormat());
  }
}

TEST(Codec, LevelsOfDetailWithoutMeaningAreRefused) {
  const Box box{{0, 0, 0}, {1, 1, 1}};
  std::vector<Lod> wrong(9);
  wrong[0].error = -1;
  wrong[1].error = kNan;
  wrong[2].error = kInf;
  wrong[3].error_percent = 100.5;
  wrong[4].error_percent = kNan;
  wrong[5].roi = box;
  wrong[5].roi->min[1] = 2;
  wrong[6].roi = box;
  wrong[6].roi->max[2] = kInf;
  wrong[7].roi = box;
  wrong[7].roi->min[0] = kNan;
  wrong[8].error_percent = -0.5;
  for (const Range& range : {Range{1, 0}, Range{std::nan(""), 0}, Range{0, std::nan("")}}) {
    EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{1, {}, {}, {}, {{range}, {}}}))));
    EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{1, {}, {}, {}, {{{0, 1}, range, {0, 1}}, {}}}))));
  }
  const auto five = decode_client_message(encode(ClientMessage(View{1, {}, {}, {}, {std::vector<Range>(kMaxRanges + 1, {0, 1}), {}}})));
  ASSERT_FALSE(five);
  EXPECT_EQ(five.error().message, "malformed message: a view of 5 ranges, of which at most 4 can be shown");
  EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{1, {}, {}, {}, {{}, Refine(2)}}))));
  for (const double percent : {-1.0, 100.5, kNan, kInf, -kInf})
    EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{.epoch = 1, .lod = {}, .coarse_error_percent = percent})))) << percent;
  const Lod with_camera{.camera = Camera{.look_at = {1, 0, 0}}};
  const View seen{.epoch = 1, .lod = with_camera, .depth = DepthMap{2, 2, 0.5, 9, {0, 1, 254, 255}}};
  const auto decoded = decode_client_message(encode(ClientMessage(seen)));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(std::get<View>(*decoded), seen);
  for (const DepthMap& map : {DepthMap{2, 2, 0.5, 9, {0, 1, 2}}, DepthMap{0, 2, 0.5, 9, {}}, DepthMap{65, 1, 0.5, 9, std::vector<std::uint8_t>(65)},
                              DepthMap{1, 1, kNan, 9, {0}}, DepthMap{1, 1, 2, 1, {0}}, DepthMap{1, 1, 1, kInf, {0}}})
    EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{.epoch = 1, .lod = with_camera, .depth = map}))));
  EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{.epoch = 1, .lod = {}, .depth = seen.depth})))) << "without a camera";
  View moving{.epoch = 1, .lod = with_camera, .ahead = Camera{.eye = {0.5, 0, 0}, .look_at = {1, 0, 0}}};
  const auto going = decode_client_message(encode(ClientMessage(moving)));
  ASSERT_TRUE(going) << going.error().message;
  EXPECT_EQ(std::get<View>(*going), moving);
  moving.lod = {};
  EXPECT_FALSE(decode_client_message(encode(ClientMessage(moving)))) << "ahead of no camera";
  for (const Camera& ahead :
       {Camera{}, Camera{.eye = {kNan, 0, 0}, .look_at = {1, 0, 0}}, Camera{.look_at = {0, 1, 0}}, Camera{.look_at = {1, 0, 0}, .fov = 180},
        Camera{.look_at = {1, 0, 0}, .viewport = {0, 1}}, Camera{.look_at = {1, 0, 0}, .pixel_error = -kInf}})
    EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{.epoch = 1, .lod = with_camera, .ahead = ahead}))));
  for (const Lod& lod : wrong) EXPECT_FALSE(decode_client_message(encode(ClientMessage(View{1, lod})))) << &lod - wrong.data();
}

TEST(Codec, ABatchesEnvelopeIsWithinItsLimit) {
  constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
  for (const std::size_t size : {0, 1, 2, 3, 5, 1000, 65536}) {
    const Batch batch{kMost, kMost, 0xffffffff, 1e300, 1e300, kMost, Bytes(size)};
    EXPECT_LE(encode(ServerMessage(batch)).size(), size + kBatchEnvelope);
    EXPECT_LE(encode(ServerMessage(batch)).size(), cost_of(batch));
  }
}

}  // namespace
}  // namespace intervale::protocol
