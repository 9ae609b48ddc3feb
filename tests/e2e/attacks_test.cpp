// Clients that do not keep to the protocol, and those beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <ostream>
#include <vector>

#include "protocol/codec.h"
#include "tests/support/raw_client.h"
#include "tests/support/serving.h"

namespace intervale {
namespace {

using protocol::CloseCode;
using protocol::Credit;
using protocol::Open;
using protocol::View;

struct Attack {
  const char* name;
  CloseCode code;
  std::function<void(RawClient&)> act;
};

void PrintTo(const Attack& attack, std::ostream* out) { *out << attack.name; }

std::vector<std::uint8_t> bytes_of(std::size_t size, std::uint8_t value) { return std::vector<std::uint8_t>(size, value); }

View view_with_error(double error) {
  View view = kEverything;
  view.lod.error = error;
  return view;
}

std::vector<Attack> attacks() {
  constexpr std::size_t kTooMuch = protocol::kMaxClientMessage + 1;
  return {
      {"Garbage", CloseCode::malformed, [](RawClient& c) { c.send_binary(bytes_of(100, 0xa5)); }},
      {"Nothing", CloseCode::malformed, [](RawClient& c) { c.send_binary({}); }},
      {"LargestGarbage", CloseCode::malformed, [](RawClient& c) { c.send_binary(bytes_of(kTooMuch - 1, 1)); }},
      {"GarbageWhileStreaming", CloseCode::malformed,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send_binary(bytes_of(100, 0xa5));
       }},
      {"NotANumber", CloseCode::malformed,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(view_with_error(std::numeric_limits<double>::quiet_NaN()));
       }},
      {"AServersMessage", CloseCode::malformed,
       [](RawClient& c) {
         c.send_binary(protocol::encode(protocol::ServerMessage(protocol::Fault{CloseCode::malformed, "you"})));
       }},
      {"Text", CloseCode::text_frame, [](RawClient& c) { c.send_text("hello"); }},
      {"TextWhileStreaming", CloseCode::text_frame,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send_text("hello");
       }},
      {"TooLarge", CloseCode::too_large, [](RawClient& c) { c.send_binary(bytes_of(kTooMuch, 0)); }},
      {"MuchTooLarge", CloseCode::too_large, [](RawClient& c) { c.send_binary(bytes_of(4 << 20, 0)); }},
      {"TooLargeInPieces", CloseCode::too_large,
       [](RawClient& c) {
         for (std::size_t sent = 0; sent < kTooMuch; sent += 1000) c.send_binary(bytes_of(1000, 0), false);
       }},
      {"TooMuchCredit", CloseCode::too_large,
       [](RawClient& c) {
         c.send(Open{"buckyball", "", protocol::kMaxWindow + 1});
       }},
      {"CreditThatOverflows", CloseCode::too_large,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(Credit{std::numeric_limits<std::uint64_t>::max()});
       }},
      {"NoSuchDataset", CloseCode::no_such_dataset,
       [](RawClient& c) {
         c.send(Open{"../buckyball", "", 0});
       }},
      {"AnOlderVersion", CloseCode::other_version, [](RawClient& c) { c.send(Open{.dataset = "buckyball", .payload = 0}); }},
      {"ViewBeforeOpen", CloseCode::out_of_order, [](RawClient& c) { c.send(kEverything); }},
      {"CreditBeforeOpen", CloseCode::out_of_order, [](RawClient& c) { c.send(Credit{1}); }},
      {"HaveBeforeOpen", CloseCode::out_of_order, [](RawClient& c) { c.send(protocol::Have{}); }},
      {"HaveAfterView", CloseCode::out_of_order,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send(protocol::Have{});
       }},
      {"ForgetsWhatIsNotThere", CloseCode::malformed,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(View{1, {}, {}, {{{}, {}, supercube_key(0, {1000, 0, 0}), 1}}});
       }},
      {"OpenTwice", CloseCode::out_of_order,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kOpen);
       }},
      {"EpochTwice", CloseCode::out_of_order,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send(kEverything);
       }},
  };
}

Attack view_attack(const char* name, CloseCode code, const std::function<void(View&)>& change) {
  View view = kEverything;
  change(view);
  return {name, code, [view](RawClient& c) {
            c.send(kOpen);
            c.send(view);
          }};
}

// Some of those of extreme_views_test.cpp, which has no connections.
std::vector<Attack> attacks_by_view() {
  return {
      view_attack("CameraAtWhatItLooksAt", CloseCode::malformed,
                  [](View& view) {
                    view.lod.camera = Camera{.eye = {1, 2, 3}, .look_at = {1, 2, 3}};
                  }),
      view_attack("ViewportEmpty", CloseCode::malformed,
                  [](View& view) {
                    view.lod.camera = Camera{.eye = {1, 2, 3}, .viewport = {0, 0}};
                  }),
      view_attack("RegionUpsideDown", CloseCode::malformed,
                  [](View& view) {
                    view.lod.roi = Box{{1, 1, 1}, {0, 0, 0}};
                  }),
      view_attack("FiveRanges", CloseCode::malformed,
                  [](View& view) {
                    view.shown.ranges.assign(5, {128, 188});
                  }),
      view_attack("RangeThatIsNotThere", CloseCode::no_such_range,
                  [](View& view) {
                    view.shown.ranges = {{0, 1}};
                  }),
      view_attack("ChannelThatIsNotThere", CloseCode::no_such_range, [](View& view) { view.channels = {"\x1b[2J\n"}; }),
  };
}

class Attacks : public ::testing::TestWithParam<Attack> {};

TEST_P(Attacks, CloseThatSessionWithTheCodeAndTouchNoOther) {
  const auto server = start();
  RawClient whole(server->port());
  whole.send(kOpen);
  whole.send(kEverything);
  const std::uint64_t everything = whole.stream_to_end();

  Waiting other(server->port());
  RawClient attacker(server->port());
  GetParam().act(attacker);
  const auto end = attacker.end();
  EXPECT_EQ(end.code, static_cast<unsigned>(GetParam().code));
  ASSERT_TRUE(end.fault);
  EXPECT_EQ(end.fault->code, GetParam().code);
  EXPECT_NE(end.fault->text, "");
  EXPECT_EQ(other.finish(), everything);
}

constexpr auto kNameOf = [](const auto& attack) { return attack.param.name; };
INSTANTIATE_TEST_SUITE_P(Server, Attacks, ::testing::ValuesIn(attacks()), kNameOf);
INSTANTIATE_TEST_SUITE_P(ServerByView, Attacks, ::testing::ValuesIn(attacks_by_view()), kNameOf);

TEST(Attacks, ViewsThatAreOnlyExtremeAreAnswered) {
  const auto server = start();
  RawClient client(server->port());
  client.send(kOpen);
  (void)client.expect<protocol::Opened>();
  std::vector<View> views(7);
  views[0].lod.camera = Camera{.eye = {1e300, 0, 0}, .pixel_error = 1e30};
  views[1].lod.camera = Camera{.eye = {0, 0, 1e-300}, .fov = 1e-300, .viewport = {1, 65535}};
  views[2].lod.roi = Box{{1e300, 1e300, 1e300}, {1e308, 1e308, 1e308}};
  views[3].lod.max_updates = 0;
  views[4].room = 0;
  views[5].coarse_error_percent = 0;  // of a data set of one range
  views[6].lod.max_updates = views[6].room = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t updates = 0;
  for (View& view : views) {
    view.epoch = views.data() + views.size() == &view + 1 ? std::numeric_limits<std::uint64_t>::max() : std::uint64_t(&view - views.data());
    client.send(view);
    updates += client.stream_to_end();
  }
  EXPECT_EQ(updates, everything(server->port()));
}

}  // namespace
}  // namespace intervale
