// Views with extreme or senseless values, as a session gets them from the network: each is answered to its end or ends
// the session with its close code, and a session beside it is served as if nothing had been.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/ivm/every_range.h"
#include "protocol/codec.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "tests/support/channels.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/server_session.h"
#include "tests/support/special_values.h"

namespace intervale::extreme_views {
namespace {

using protocol::CloseCode;
using protocol::View;

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
constexpr std::int32_t kSide = 17;
constexpr SupercubeKey kElsewhere = SupercubeKey(1) << 40;

enum class Kind { every_range, one_range };

// A gyroid of every range, or of one refined at its surfaces; both with the channels "noise" and "place".
Catalogue::Volume make_volume(Kind kind) {
  Volume samples = testing::gyroid({kSide, kSide, kSide});
  samples.name = kind == Kind::every_range ? "every" : "one";
  std::optional<IntervalVolume> volume;
  if (kind == Kind::every_range) {
    volume = of_every_range(build_value_volume(samples, choose_value_format(samples, {}).value()).take()).value();
  } else {
    volume = testing::build(samples, {.range = {-0.3, 0.2}});
  }
  testing::set_channels(*volume, 1);
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

const Catalogue::Volume& volume_of(Kind kind) {
  static const Catalogue::Volume every = make_volume(Kind::every_range), one = make_volume(Kind::one_range);
  return kind == Kind::every_range ? every : one;
}

// What becomes of a view: a code that ends the session, or so many updates, and Done.
enum class Updates { some, all, none };
struct Answer {
  CloseCode code = CloseCode::normal;
  Updates updates = Updates::some;
  bool full = false;  // of Done
};
const Answer kSome, kAll{.updates = Updates::all}, kNone{.updates = Updates::none}, kFull{.updates = Updates::none, .full = true},
    kMalformed{CloseCode::malformed}, kOutOfOrder{CloseCode::out_of_order}, kNoSuchRange{CloseCode::no_such_range};

struct Case {
  const char* name;
  Answer answer;
  std::function<void(View&)> change;  // from the view of everything, with epoch 5
  std::vector<View> before = {};      // views that are answered first
  Kind kind = Kind::every_range;
};
// One that looks at all of the box, and so at the surfaces of a range; then changed.
std::function<void(View&)> camera(const std::function<void(Camera&)>& change) {
  return [change](View& view) {
    view.lod.camera = Camera{.eye = {40, 30, 25}, .look_at = {8, 8, 8}, .up = {0, 0, 1}, .viewport = {640, 480}, .pixel_error = 1e-3};
    change(*view.lod.camera);
    if (view.shown.ranges.empty()) view.shown.ranges = {{-0.3, 0.2}};
  };
}
std::function<void(View&)> region(const Vec3& min, const Vec3& max) {
  return [=](View& view) { view.lod.roi = Box{min, max}; };
}
std::function<void(View&)> ranges(const std::vector<Range>& shown) {
  return [=](View& view) { view.shown.ranges = shown; };
}
std::function<void(View&)> channels(const std::vector<std::string>& names) {
  return [=](View& view) { view.channels = names; };
}
std::function<void(View&)> forget(const std::vector<SlotGroup>& groups) {
  return [=](View& view) { view.forget = groups; };
}

// The camera that a codec refuses; CheckLod.RefusesCamerasThatSeeNothing has them all.
std::vector<Case> senseless_cameras() {
  return {
      {"EyeIsNoNumber", kMalformed, camera([](Camera& c) { c.eye[1] = kNan; })},
      {"LooksAtInfinity", kMalformed, camera([](Camera& c) {
         c.look_at = {-kInf, 0, 0};
       })},
      {"LooksAtItsOwnEye", kMalformed, camera([](Camera& c) { c.look_at = c.eye; })},
      {"EyeWhoseDistanceOverflows", kMalformed, camera([](Camera& c) {
         c.eye = {1e308, 0, 0}, c.look_at = {-1e308, 0, 0};
       })},
      {"UpIsZero", kMalformed, camera([](Camera& c) { c.up = {}; })},
      {"UpAlongTheLineOfSight", kMalformed, camera([](Camera& c) {
         c.up = {-32, -22, -17};
       })},
      {"FieldOfView0", kMalformed, camera([](Camera& c) { c.fov = 0; })},
      {"FieldOfView180", kMalformed, camera([](Camera& c) { c.fov = 180; })},
      {"FieldOfViewNegative", kMalformed, camera([](Camera& c) { c.fov = -45; })},
      {"ViewportEmpty", kMalformed, camera([](Camera& c) {
         c.viewport = {0, 0};
       })},
      {"ViewportNegative", kMalformed, camera([](Camera& c) {
         c.viewport = {-640, -480};
       })},
      {"ViewportHuge", kMalformed, camera([](Camera& c) {
         c.viewport = {std::numeric_limits<int>::max(), 480};
       })},
      {"PixelError0", kMalformed, camera([](Camera& c) { c.pixel_error = 0; })},
      {"PixelErrorNegative", kMalformed, camera([](Camera& c) { c.pixel_error = -1e-30; })},
      {"PixelErrorIsNoNumber", kMalformed, camera([](Camera& c) { c.pixel_error = kNan; })},
      {"PixelErrorInfinite", kMalformed, camera([](Camera& c) { c.pixel_error = kInf; })},
  };
}

std::vector<Case> extreme_cameras() {
  return {
      {"EyeInTheVolume", kSome, camera([](Camera& c) {
         c.eye = {8.1, 7.9, 8.3}, c.look_at = {8.2, 8, 9}, c.up = {0, 1, 0};
       })},
      {"EyeOnASample", kSome, camera([](Camera& c) {
         c.eye = {8, 8, 8}, c.look_at = {8, 8, 9}, c.up = {0, 1, 0};
       })},
      {"EyeOnACorner", kSome, camera([](Camera& c) { c.eye = {}; })},
      {"LooksAway", kSome, camera([](Camera& c) {
         c.look_at = {80, 60, 50};
       })},
      {"LooksAlongASide", kSome, camera([](Camera& c) {
         c.eye = {-1, 0, 0}, c.look_at = {17, 0, 0};
       })},
      {"EyeFarAway", kNone, camera([](Camera& c) {
         c.eye = {1e150, 1e150, 1e150};
       })},
      {"EyeAsFarAsCanBe", kNone, camera([](Camera& c) {
         c.eye = {1e308, -1e308, 0};
       })},
      {"EyeJustBeforeWhatItLooksAt", kSome, camera([](Camera& c) {
         c.look_at = {0, 0, 0}, c.eye = {1e-150, 0, 0};
       })},
      {"UpVeryLong", kSome, camera([](Camera& c) {
         c.up = {0, 0, 1e300};
       })},
      {"UpVeryShort", kSome, camera([](Camera& c) {
         c.up = {0, 0, 1e-300};
       })},
      {"FieldOfViewTiny", kSome, camera([](Camera& c) { c.fov = 1e-300; })},
      {"FieldOfViewOfTheLeastNumber", kSome, camera([](Camera& c) { c.fov = std::numeric_limits<double>::denorm_min(); })},
      {"FieldOfViewNearly180", kNone, camera([](Camera& c) { c.fov = 179.9999999999; })},
      {"ViewportOfOnePixel", kSome, camera([](Camera& c) {
         c.viewport = {1, 1};
       })},
      {"ViewportOfTheMostPixels", kSome, camera([](Camera& c) {
         c.viewport = {65535, 65535};
       })},
      {"ViewportOfOneColumn", kSome, camera([](Camera& c) {
         c.viewport = {1, 65535};
       })},
      {"PixelErrorTiny", kSome, camera([](Camera& c) { c.pixel_error = 1e-30; })},
      {"PixelErrorOfTheLeastNumber", kSome, camera([](Camera& c) { c.pixel_error = std::numeric_limits<double>::denorm_min(); })},
      {"PixelErrorLarge", kNone, camera([](Camera& c) { c.pixel_error = 1e30; })},
      {"PixelErrorOfTheGreatestNumber", kNone, camera([](Camera& c) { c.pixel_error = std::numeric_limits<double>::max(); })},
      {"PixelErrorOfTheGreatestNumberEarly", kNone,
       [](View& view) {
         camera([](Camera& c) { c.pixel_error = std::numeric_limits<double>::max(); })(view);
         view.early = true;
       }},
  };
}

std::vector<Case> amounts() {
  const auto all_of = [](std::uint64_t room, std::uint64_t most) { return [=](View& view) { view.room = room, view.lod.max_updates = most; }; };
  return {
      {"ErrorLarge", kNone, [](View& view) { view.lod.error = 1e300; }},
      {"ErrorOfTheLeastNumber", kSome, [](View& view) { view.lod.error = std::numeric_limits<double>::denorm_min(); }},
      {"ErrorBelowZero", kMalformed, [](View& view) { view.lod.error = -1e-300; }},
      {"ErrorPercent0", kAll, [](View& view) { view.lod.error_percent = 0; }},
      {"ErrorPercent100", kNone, [](View& view) { view.lod.error_percent = 100; }},
      {"ErrorPercent101", kMalformed, [](View& view) { view.lod.error_percent = 101; }},
      {"ErrorPercentIsNoNumber", kMalformed, [](View& view) { view.lod.error_percent = kNan; }},
      {"RegionUpsideDown", kMalformed, region({1, 1, 1}, {1, 0, 1})},
      {"RegionInfinite", kMalformed, region({-kInf, -kInf, -kInf}, {kInf, kInf, kInf})},
      {"RegionOfAllNumbers", kAll, region({-1e308, -1e308, -1e308}, {1e308, 1e308, 1e308})},
      {"RegionOutside", kNone, region({1e3, 1e3, 1e3}, {1e308, 1e308, 1e308})},
      {"RegionOfOnePoint", kSome, region({8, 8, 8}, {8, 8, 8})},
      {"RegionOfOnePointOutside", kNone, region({-1, -1, -1}, {-1, -1, -1})},
      {"NoUpdates", kNone, [](View& view) { view.lod.max_updates = 0; }},
      {"OneUpdate", kSome, [](View& view) { view.lod.max_updates = 1; }},
      {"TheMostUpdates", kAll, [](View& view) { view.lod.max_updates = kMost; }},
      {"NoRoom", kFull, [](View& view) { view.room = 0; }},
      {"RoomForOne", {.full = true}, [](View& view) { view.room = 1; }},
      {"TheMostRoom", kAll, [](View& view) { view.room = kMost; }},
      {"NeitherUpdatesNorRoom", kFull, all_of(0, 0)},
      {"TheMostUpdatesWithoutRoom", kFull, all_of(0, kMost)},
      {"CameraWithoutUpdates", kNone,
       [](View& view) {
         camera([](Camera&) {})(view);
         view.lod.max_updates = 0;
       }},
      {"RegionOutsideWithRoomAndCamera", kNone,
       [=](View& view) {
         camera([](Camera&) {})(view);
         region({-9, -9, -9}, {-8, -8, -8})(view);
         all_of(kMost, kMost)(view);
       }},
  };
}

std::vector<Case> shown_parts() {
  const Range all{-kInf, kInf};
  std::vector<SlotGroup> many(protocol::kMaxHave + 1, {{}, {}, 0, 1});
  for (std::size_t i = 0; i < many.size(); ++i) many[i].key = supercube_key(0, {std::int32_t(i), 0, 0});
  const Place first = volume_of(Kind::every_range)->set().place(UpdateIndex(0));
  const SupercubeKey root = first.key;
  const std::uint64_t slot = std::uint64_t(1) << first.slot;
  return {
      {"RangeUpsideDown", kMalformed, ranges({{1, -1}})},
      {"RangeIsNoNumber", kMalformed, ranges({{kNan, kNan}})},
      {"FiveRanges", kMalformed, ranges(std::vector<Range>(5, all))},
      {"FourRangesOfEverything", kNone, ranges(std::vector<Range>(4, all))},
      {"FourRanges", kSome, ranges({{-1, -0.9}, {0, 0}, {-0.0, 0.0}, {0.9, 1}})},
      {"RangeBelowAllNumbers", kNone, ranges({{-kInf, -kInf}})},
      {"RangeAboveTheValues", kNone, ranges({{1e308, std::numeric_limits<double>::max()}})},
      {"RangeOfTheLeastNumber", kSome, ranges({{0, std::numeric_limits<double>::denorm_min()}})},
      {"ARangeThatIsNotThere", kNoSuchRange, ranges({{0, 0.1}}), {}, Kind::one_range},
      {"RefinedAsItIsNot", kNoSuchRange, [](View& view) { view.shown.refine = Refine::uniform; }, {}, Kind::one_range},
      {"RefinedInNoWay", kMalformed, [](View& view) { view.shown.refine = Refine(254); }},
      {"ChannelThatIsNotThere", kNoSuchRange, channels({"noise", "surface"})},
      {"ChannelWithoutAName", kNoSuchRange, channels({""})},
      {"ChannelOfEscapes", kNoSuchRange, channels({"\x1b[2J\n" + std::string(50, '\xff')})},
      {"ChannelWithALongName", kMalformed, channels({std::string(65, 'x')})},
      {"SixteenTimesOneChannel", kAll, channels(std::vector<std::string>(16, "noise"))},
      {"SeventeenChannels", kMalformed, channels(std::vector<std::string>(17, "noise"))},
      {"ForgetsWhatWasNotSent", kAll, forget({{{}, {}, root, slot}})},
      {"ForgetsWhatIsNotThere", kMalformed, forget({{{}, {}, supercube_key(0, {1000, 0, 0}), 1}})},
      {"ForgetsNoSlots", kMalformed, forget({{{}, {}, root, 0}})},
      {"ForgetsBackwards", kMalformed, forget({{{}, {}, root + kElsewhere, 1}, {{}, {}, root, 1}})},
      {"ForgetsTooMany", kMalformed, forget(many)},
      {"ForgetsAllWithoutRoom", kFull,
       [=](View& view) {
         forget({{{}, {}, root, slot}})(view);
         view.room = 0;
       }},
  };
}

std::vector<Case> epochs_and_all_at_once() {
  const auto epoch = [](std::uint64_t e) { return [e](View& view) { view.epoch = e; }; };
  const auto nothing = [](std::uint64_t e) { return View{.epoch = e, .lod = {.max_updates = 0}}; };
  const auto coarse = [](double percent) { return [percent](View& view) { view.coarse_error_percent = percent, view.lod.max_updates = 0; }; };
  return {
      {"Epoch0", kAll, epoch(0)},
      {"Epoch0Twice", kOutOfOrder, epoch(0), {nothing(0)}},
      {"TheSameEpoch", kOutOfOrder, epoch(7), {nothing(7)}},
      {"AnOlderEpoch", kOutOfOrder, epoch(6), {nothing(7)}},
      {"TheGreatestEpoch", kAll, epoch(kMost), {nothing(kMost - 1)}},
      {"TheGreatestEpochTwice", kOutOfOrder, epoch(kMost), {nothing(kMost)}},
      {"TheEpochAfterTheGreatest", kOutOfOrder, epoch(0), {nothing(kMost)}},
      {"CoarseIsNoNumber", kMalformed, coarse(kNan)},
      {"CoarseLarge", kMalformed, coarse(1e300)},
      {"CoarseNegative", kMalformed, coarse(-0.1)},
      {"Coarse0WithoutUpdates", kNone, coarse(0)},  // what follows is within max_updates, too
      {"Coarse0", kAll,
       [](View& view) {
         view.coarse_error_percent = 0, view.shown.ranges = {{5, 6}};
       }},
      {"Coarse100", kNone,
       [](View& view) {
         view.coarse_error_percent = 100, view.shown.ranges = {{5, 6}};
       }},
      {"CoarseOfOneRange", kAll, [](View& view) { view.coarse_error_percent = 0; }, {}, Kind::one_range},
      {"EverythingAtOnce", kAll,
       [](View& view) {
         view.early = true;
         view.coarse_error_percent = 0;
         view.shown = {{{-kInf, 0}, {0, kInf}, {0.5, 0.5}, {7, 8}}, Refine::uniform};
         camera([](Camera& c) { c.pixel_error = 1e-30; })(view);
         region({-1e300, -1e300, -1e300}, {1e300, 1e300, 1e300})(view);
         view.lod.error = std::numeric_limits<double>::denorm_min();
         view.lod.error_percent = 0;
         view.lod.max_updates = view.room = kMost;
         view.channels = {"place", "noise", "place"};
       }},
  };
}

std::vector<Case> all_cases() {
  std::vector<Case> all;
  for (const auto& cases : {senseless_cameras(), extreme_cameras(), amounts(), shown_parts(), epochs_and_all_at_once()})
    all.insert(all.end(), cases.begin(), cases.end());
  return all;
}

void expect_answer(const Case& c) {
  const std::uint64_t all = volume_of(c.kind)->size();
  testing::SharedByServer shared({volume_of(Kind::every_range), volume_of(Kind::one_range)});
  testing::ServerSession other(shared), session(shared);
  for (testing::ServerSession* const s : {&other, &session}) ASSERT_EQ(s->open(volume_of(c.kind)->description().name), CloseCode::normal);
  ASSERT_EQ(other.send(View{.epoch = 1, .lod = {}}), CloseCode::normal);
  (void)other.take_all(1);
  for (const View& view : c.before) {
    ASSERT_EQ(session.send(view), CloseCode::normal);
    ASSERT_TRUE(session.take_all());
  }

  View view{.epoch = 5, .lod = {}};
  c.change(view);
  ASSERT_EQ(session.send(view), c.answer.code);
  if (c.answer.code == CloseCode::normal) {
    const auto done = session.take_all();
    ASSERT_TRUE(done);
    EXPECT_EQ(done->epoch, view.epoch);
    EXPECT_EQ(done->full, c.answer.full);
    EXPECT_LE(session.updates(), all);
    EXPECT_EQ(session.updates() == 0, c.answer.updates == Updates::none) << session.updates();
    EXPECT_TRUE(session.updates() == all || c.answer.updates != Updates::all) << session.updates();
    EXPECT_EQ(session.send(view), CloseCode::out_of_order) << "the session goes on, and knows its epoch";
  }
  ASSERT_TRUE(other.take_all());
  EXPECT_EQ(other.updates(), all);
}

// One test of all: parameters of a test would be made at the start of each process.
TEST(ExtremeViews, AreAnsweredOrEndTheSessionAndTouchNoOther) {
  for (const Case& c : all_cases()) {
    SCOPED_TRACE(c.name);
    expect_answer(c);
  }
}

}  // namespace
}  // namespace intervale::extreme_views
