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

class Attacks : public testing::TestWithParam<Attack> {};

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

INSTANTIATE_TEST_SUITE_P(Server, Attacks, testing::ValuesIn(attacks()), [](const auto& attack) { return attack.param.name; });

}  // namespace
}  // namespace intervale
