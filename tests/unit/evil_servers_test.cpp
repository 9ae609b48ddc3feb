// What a server may say that lies: the client ends the session with an error of one line, or takes it as PROTOCOL.md says.
// Messages out of order, and of other versions: client_session_test.cpp; descriptions by themselves: stream_client_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "common/codec/batch.h"
#include "common/codec/split_names.h"
#include "common/selection/stream_plan.h"
#include "common/util/printable.h"
#include "protocol/codec.h"
#include "tests/support/channels.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/special_values.h"

namespace intervale::evil_servers {
namespace {

using protocol::CloseCode, protocol::Done, protocol::Fault, protocol::Opened, protocol::ServerMessage;
using ::testing::HasSubstr;
using State = ClientSession::State;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();

// An honest server's Opened, and its batches of everything.
struct Honest {
  std::shared_ptr<const IntervalVolume> volume;
  Opened opened;
  std::vector<protocol::Batch> batches;
};

Honest make_honest(const Volume& samples, const Range& range) {
  IntervalVolume made = testing::build(samples, {.range = range});
  testing::set_channels(made, 1);
  const auto volume = std::make_shared<const IntervalVolume>(std::move(made));
  Honest honest{volume, {volume->description(), {}}, {}};
  StreamPlan plan(volume);
  plan.set_lod({});
  while (auto batch = plan.next(4096)) {
    honest.batches.push_back(
        {.epoch = 1, .sequence = honest.batches.size(), .updates = batch->updates, .payload = std::move(batch->payload), .channels = {}});
  }
  return honest;
}

const Honest& honest() {
  static const Honest one = make_honest(testing::gyroid({17, 17, 17}), {-0.3, 0.2});
  return one;
}

// What is said, message by message; only of the last one it is asked what becomes of it.
using Script = std::vector<Bytes>;

struct Lie {
  const char* name;
  Script script;
  std::optional<std::string> about;  // that the error contains; nothing: it is accepted
  State state = State::closed;       // then
  ViewRequest view = {};
};
Bytes bytes(const ServerMessage& message) { return protocol::encode(message); }

Script opened(const std::function<void(Description&)>& change) {
  Opened message = honest().opened;
  change(message.description);
  return {bytes(message)};
}
// After an honest Opened: the first batch, changed.
Script batch(const std::function<void(protocol::Batch&)>& change) {
  protocol::Batch message = honest().batches.at(0);
  change(message);
  return {bytes(honest().opened), bytes(message)};
}
Script payload(Bytes of) {
  return batch([&of](protocol::Batch& b) { b.payload = std::move(of); });
}
Script followed_by(Script script, const std::vector<ServerMessage>& messages) {
  for (const ServerMessage& message : messages) script.push_back(bytes(message));
  return script;
}
Bytes noise(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  Bytes noise(size);
  for (auto& byte : noise) byte = std::uint8_t(random());
  return noise;
}
// A batch that names so many supercubes, and nothing else.
Bytes names(std::uint64_t supercubes) {
  std::vector<SlotGroup> groups;
  for (SupercubeKey k = 0; k < supercubes; ++k) groups.push_back({{}, {}, supercube_key(0, {}) + k, 1});
  RangeEncoder coder;
  coder.raw_bits(1, 0);
  encode_supercubes(coder, false, groups);
  return coder.finish();
}

std::vector<Lie> descriptions() {
  const auto none = [](Description&) {};
  const auto channel = [](const std::function<void(Channel&)>& change) { return opened([&](Description& d) { change(d.channels.at(0)); }); };
  const char* const kInvalid = "an invalid description";
  return {
      {"SidesOf1", opened([](Description& d) {
         d.grid.dims = {1, 1, 1};
       }),
       kInvalid},
      {"SidesOf0", opened([](Description& d) {
         d.grid.dims = {0, 17, 17};
       }),
       kInvalid},
      {"SidesTooLong", opened([](Description& d) {
         d.grid.dims = {17, 17, (1 << 20) + 1};
       }),
       kInvalid},
      {"TheLargestOfAll",
       opened([](Description& d) {
         d.grid.dims = {1 << 20, 1 << 20, 1 << 20};
         d.channels.clear();
         d.updates = d.coefficients = d.full.vertices = d.full.tets = d.content_hash = kMost;
         d.max_error = std::numeric_limits<double>::max();
       }),
       {},
       State::viewing},
      {"AffineOfNoNumbers", opened([](Description& d) { d.grid.affine.rows.fill(kNan); }), kInvalid},
      {"AffineOfZeros", opened([](Description& d) { d.grid.affine.rows.fill(0); }), kInvalid},
      {"NameTooLong", opened([](Description& d) { d.name.assign(256, 'x'); }), "name is too long"},
      {"UnitTooLong", opened([](Description& d) { d.labels.unit.assign(65, 'x'); }), "label is too long"},
      {"SpaceTooLong", opened([](Description& d) { d.labels.space.assign(65, 'x'); }), "label is too long"},
      {"UnitOfEscapes", opened([](Description& d) { d.labels.unit = "\x1b[2J\n"; }), kInvalid},
      {"FieldThatIsNoText", opened([](Description& d) { d.labels.field = "\xff\xfe"; }), kInvalid},
      {"RangeUpsideDown", opened([](Description& d) {
         d.range = {1, -1};
       }),
       kInvalid},
      {"EveryRangeThatIsOne", opened([](Description& d) { d.has_every_range = true; }), kInvalid},
      {"RefinedInNoWay", opened([](Description& d) { d.refine = Refine(7); }), "unknown refinement"},
      {"StepTiny", opened([](Description& d) { d.format.step = 1e-300; }), kInvalid},
      {"TooManyKeys", opened([](Description& d) { d.format.last = 0xffffffff; }), kInvalid},
      {"SeventeenChannels", opened([](Description& d) { d.channels.resize(17, d.channels.at(0)); }), "too many channels"},
      {"TwoChannelsOfOneName", opened([](Description& d) { d.channels.at(1).name = d.channels.at(0).name; }), kInvalid},
      {"ChannelOfEscapes", channel([](Channel& c) { c.name = "\x1b]0;x\x07"; }), kInvalid},
      {"ChannelCalledValue", channel([](Channel& c) { c.name = "value"; }), kInvalid},
      {"ChannelWithoutComponents", channel([](Channel& c) { c.components.clear(); }), kInvalid},
      {"ChannelOfFourComponents", channel([](Channel& c) { c.components.resize(4, c.components.at(0)); }), "too many components"},
      {"ChannelWithAStepThatIsNoNumber", channel([](Channel& c) { c.components.at(0).format.step = kNan; }), kInvalid},
      {"ChannelWithACornerBeyondTheLast", channel([](Channel& c) { c.components.at(0).corners[0] = 0xfffffffe; }), kInvalid},
      {"TableThatDescends", opened([](Description& d) {
         d.format = format_of_table(SampleType::f64, {3, 2, 1});
         d.corners.fill(0);
       }),
       kInvalid},
      {"TableOfNoNumbers", opened([](Description& d) {
         d.format = format_of_table(SampleType::f64, {1, kInf});
         d.corners.fill(0);
       }),
       kInvalid},
      {"LimitsOfNothing", {bytes(Opened{honest().opened.description, {0, kMost, 0}})}, {}, State::viewing},
      {"ResumedWithoutReason", {bytes(Opened{honest().opened.description, {}, true})}, {}, State::viewing},
      {"ANameOfEscapesThatAnErrorNames",
       opened([](Description& d) { d.name = "\x1b[2J\nx"; }),
       "was built for the range",
       State::closed,
       {.shown = {{{5, 6}}, {}}}},
      {"WithoutTheChannelOfTheView", opened(none), "no channel", State::closed, {.channels = {"\x1b[2J"}}},
  };
}

std::vector<Lie> batches() {
  const Honest other = make_honest(testing::digits({9, 12, 5}, 3), {3, 5.5});
  const Bytes good = honest().batches.at(0).payload;
  Bytes trailing = good;
  trailing.push_back(0);
  const Bytes many = names(kBatchUpdatesMost), too_many = names(kBatchUpdatesMost + 1);
  protocol::Batch again = honest().batches.at(0);
  again.sequence = 1;
  protocol::Batch second = honest().batches.at(1);
  second.sequence = 0;
  const ViewRequest with_noise{.channels = {"noise"}};
  return {
      {"UpdatesOfNoBytes", payload({}), "damaged"},
      {"UpdatesOfNoise", payload(noise(1000, 1)), "damaged"},
      {"UpdatesOfMuchNoise", payload(noise(protocol::kMaxBatchPayload, 2)), "damaged"},
      {"UpdatesTooLarge", payload(noise(protocol::kMaxBatchPayload + 1, 3)), "too large"},
      {"UpdatesOfZeros", payload(Bytes(4096)), "damaged"},
      {"UpdatesAndMore", payload(trailing), "damaged"},
      {"UpdatesOfAnotherDataSet", payload(other.batches.at(0).payload), "violated the protocol"},
      {"UpdatesOfOnes", payload(Bytes(4096, 0xff)), "damaged"},
      {"NamesThatDoNotEnd", payload({many.begin(), many.begin() + 8}), "damaged"},
      {"NamesWithoutUpdates", payload(many), "not as many updates as it says"},
      {"NamesThatAreTooMany", payload(too_many), "damaged"},
      {"FewerUpdatesThanItSays", batch([](protocol::Batch& b) { ++b.updates; }), "not as many updates as it says"},
      {"MoreUpdatesThanItSays", batch([](protocol::Batch& b) { b.updates = 0; }), "not as many updates as it says"},
      {"TheMostUpdates", batch([](protocol::Batch& b) { b.updates = 0xffffffff; }), "violated the protocol"},
      {"TheSameAgain", followed_by(batch([](protocol::Batch&) {}), {again}), "damaged"},
      {"TheSecondFirst", {bytes(honest().opened), bytes(second)}, "damaged"},
      {"TheLastSequence", batch([](protocol::Batch& b) { b.sequence = kMost; }), "a batch is missing"},
      {"TheLastEpoch", batch([](protocol::Batch& b) { b.epoch = kMost; }), "a view that is not open"},
      {"Epoch0", batch([](protocol::Batch& b) { b.epoch = 0; }), "a view that is not open"},
      {"BoundsThatAreNoNumbers", batch([](protocol::Batch& b) { b.remaining_pixels = kNan; }), "remaining pixels"},
      {"BoundsBelowZero", batch([](protocol::Batch& b) { b.remaining_error = -1; }), "remaining error"},
      {"BoundsOfInfinity",
       batch([](protocol::Batch& b) { b.remaining_error = b.remaining_pixels = kInf, b.updates_to_go = kMost; }),
       {},
       State::viewing},
      {"ChannelsThatNobodyWants", batch([](protocol::Batch& b) { b.channels = noise(100, 4); }), "damaged"},
      {"ChannelsOfNoise", batch([](protocol::Batch& b) { b.channels = noise(1000, 5); }), "damaged", State::closed, with_noise},
      {"ChannelsWithoutUpdates", batch([](protocol::Batch& b) {
         b.channels = std::exchange(b.payload, {});
         b.updates = 0;
       }),
       "damaged", State::closed, with_noise},
      {"MoreUpdatesThanThereIsRoomFor", batch([](protocol::Batch&) {}), "more updates than the room", State::closed, {.budget = {.max_updates = 1}}},
      {"MoreUpdatesThanTheDataSetHas",
       [] {
         Script script = opened([](Description& d) { d.updates = 1; });
         script.push_back(bytes(honest().batches.at(0)));
         return script;
       }(),
       "more updates than the data set has"},
  };
}

std::vector<Lie> other_messages() {
  const Bytes first = bytes(honest().opened);
  const auto after_opened = [&](const ServerMessage& message) { return Script{first, bytes(message)}; };
  const auto fault = [](unsigned code, const std::string& text) { return Script{bytes(Fault{CloseCode(code), text})}; };
  const std::string escapes = "\x1b]0;x\x07\r\n\xe2\x80\xaegone";
  Bytes deep(4096, 4);
  return {
      {"Nothing", {Bytes()}, "not a server message"},
      {"OneByte", {Bytes(1)}, "not a server message"},
      {"Noise", {noise(300, 6)}, "not a server message"},
      {"Zeros", {Bytes(8 << 20)}, "not a server message"},
      {"OffsetsEverywhere", {deep}, "not a server message"},
      {"AClientsMessage", {protocol::encode(protocol::ClientMessage(protocol::Open{"made", "x", 1}))}, "malformed message"},
      {"DoneTwice", followed_by({first}, {Done{1, 0, false}, Done{1, 0, false}}), "a view that is not open"},
      {"DoneOfTheMostUpdates", after_opened(Done{1, kMost, false}), "updates are missing"},
      {"DoneOfEpoch0", after_opened(Done{0, 0, false}), "a view that is not open"},
      {"DoneOfTheLastEpoch", after_opened(Done{kMost, 0, false}), "a view that is not open"},
      {"DoneBeforeAnything", after_opened(Done{1, 0, false}), {}, State::idle},
      {"FullOfNothing", after_opened(Done{1, 0, true}), {}, State::idle},
      {"FaultOfEscapes", fault(4400, escapes), "code 4400"},
      {"FaultOfARangeWithEscapes", fault(4416, escapes), "gone"},
      {"FaultWithoutText", fault(4409, ""), "code 4409"},
      {"FaultWithTooMuchText", fault(4400, std::string(201, 'x')), "text is too long"},
      {"FaultOfCode0", fault(0, "x"), "code 0"},
      {"FaultOfANormalEnd", fault(1000, "x"), "code 1000"},
      {"FaultOfTheLastCode", fault(65535, "x"), "code 65535"},
      {"FaultOfAServerThatLeaves", fault(1001, escapes), "code 1001", State::connecting},
      {"FaultAfterDone", followed_by({first}, {Done{1, 0, false}, Fault{CloseCode::timed_out, "x"}}), "code 4408"},
  };
}

std::vector<Lie> all_lies() {
  std::vector<Lie> all;
  for (const auto& lies : {descriptions(), batches(), other_messages()}) all.insert(all.end(), lies.begin(), lies.end());
  return all;
}

ClientSession connected(const ViewRequest& view) {
  ClientSession session({.dataset = "made", .client = "test"});
  EXPECT_TRUE(session.look(view));
  session.connected({});
  return session;
}

void expect_told_or_ignored(const Lie& lie) {
  ClientSession session = connected(lie.view);
  for (std::size_t i = 0; i + 1 < lie.script.size(); ++i) {
    const auto event = session.receive(lie.script[i], {});
    ASSERT_TRUE(event) << event.error().message;
  }
  const auto event = session.receive(lie.script.back(), {});
  EXPECT_EQ(event.has_value(), !lie.about);
  EXPECT_EQ(session.state(), lie.state);
  if (!event) {
    EXPECT_THAT(event.error().message, HasSubstr(lie.about.value_or("nothing")));
    EXPECT_EQ(event.error().message, printable(event.error().message)) << "what reaches a terminal";
    EXPECT_LT(event.error().message.size(), 600u);
  }
  if (!event && !session.fault()) {
    EXPECT_FALSE(std::move(session).take_mesh()) << "it may be damaged";
  }
}

// One test of all: parameters of a test would be made at the start of each process.
TEST(EvilServers, AreToldInOneLineOrIgnored) {
  for (const Lie& lie : all_lies()) {
    SCOPED_TRACE(lie.name);
    expect_told_or_ignored(lie);
  }
}

// Every beginning of a batch, and batches with some bits changed. What is not refused leaves a mesh that is in order.
TEST(EvilServers, DamagedBatchesAreRefusedOrApplied) {
  const protocol::Batch good = honest().batches.at(0);
  for (std::size_t size = 0; size < good.payload.size(); ++size) {
    ClientSession session = connected({});
    ASSERT_TRUE(session.receive(bytes(honest().opened), {}));
    protocol::Batch cut = good;
    cut.payload.resize(size);
    EXPECT_FALSE(session.receive(bytes(cut), {})) << size << " bytes";
  }
  std::mt19937 random(1);
  for (int round = 0; round < 300; ++round) {
    ClientSession session = connected({});
    ASSERT_TRUE(session.receive(bytes(honest().opened), {}));
    bool accepted = true;
    for (protocol::Batch batch : honest().batches) {
      for (int flips = int(random() % 3); flips > 0; --flips) batch.payload[random() % batch.payload.size()] ^= std::uint8_t(1u << random() % 8);
      accepted = accepted && session.receive(bytes(batch), {});
    }
    if (accepted) {
      EXPECT_EQ(session.mesh()->front().validate().value_or(""), "");
    }
  }
}

// Of weights and corners that no builder finds, with which an honest server's batches mean something else.
TEST(EvilServers, WeightsOfAnySizeDoNoHarm) {
  for (const std::int16_t weight : {std::numeric_limits<std::int16_t>::min(), std::numeric_limits<std::int16_t>::max()}) {
    ClientSession session = connected({});
    const Script script = opened([weight](Description& d) {
      for (auto& scale : d.weights.of) {
        for (auto& of_class : scale) of_class.fill(weight);
      }
      d.corners.fill(weight > 0 ? d.format.last : 0);
    });
    ASSERT_TRUE(session.receive(script[0], {}));
    for (const protocol::Batch& batch : honest().batches) {
      if (!session.receive(bytes(batch), {})) break;
    }
    EXPECT_EQ(session.mesh()->front().validate(), std::nullopt);
  }
}

}  // namespace
}  // namespace intervale::evil_servers
