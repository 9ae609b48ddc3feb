// Sessions whose range changes while they receive.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "common/ivm/every_range.h"
#include "common/ivm/extraction.h"
#include "common/mesh/mesh_digest.h"
#include "common/ranges/find_relevant_updates.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "tests/support/cameras.h"
#include "tests/support/channels.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/seeds.h"
#include "tests/support/session_server.h"
#include "tests/support/special_values.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

class RangeStream : public ::testing::TestWithParam<unsigned> {
 public:
  static constexpr std::array<std::array<std::int32_t, 3>, 4> kBoxes{{{17, 17, 17}, {9, 7, 5}, {17, 12, 13}, {6, 21, 4}}};

  // Of every range, or refined uniformly; with channels.
  [[nodiscard]] std::shared_ptr<const IntervalVolume> make_volume() {
    Volume samples = field.volume;
    samples.name = "made";
    auto made = GetParam() % 3 != 0 ? of_every_range(build_value_volume(samples, field.format).take())
                                    : FieldHierarchy(samples, {testing::random_range(field, random), Refine::uniform}).compact();
    testing::set_channels(*made, {{"noise", channels[0]}, {"place", channels[1]}});
    return std::make_shared<const IntervalVolume>(std::move(*made));
  }

  // Within the data set's, one to four of them.
  [[nodiscard]] RangeRequest random_request() {
    const Range& whole = volume->description().range;
    RangeRequest request;
    request.refine = random() % 3 == 0 ? Refine::uniform : Refine::boundary;
    const std::size_t count = random() % 2 == 0 ? 1 : 1 + random() % kMaxRanges;
    while (request.ranges.size() < count) {
      const Range range = testing::random_range(field, random);
      request.ranges.push_back({std::clamp(range.alpha, whole.alpha, whole.beta), std::clamp(range.beta, whole.alpha, whole.beta)});
      if (request.ranges.size() < count && random() % 6 == 0) request.ranges.push_back(request.ranges.front());
    }
    return request;
  }

  [[nodiscard]] ViewRequest random_view() {
    ViewRequest view;
    view.shown = random_request();
    view.early = random() % 2 == 0;
    if (random() % 3 == 0) view.coarse_error_percent = double(random() % 40);
    for (const char* const name : {"place", "noise"}) {
      if (random() % 3 == 0) view.channels.emplace_back(name);
    }
    if (random() % 2 == 0) view.lod.error_percent = double(random() % 40);
    if (random() % 3 == 0) view.lod.max_updates = random() % (volume->size() + 10);
    if (random() % 3 == 0) {
      view.lod.camera = testing::random_camera(volume->description().grid, random);
      view.lod.camera->pixel_error = double(1 + random() % 64);
    }
    return view;
  }

  // Whether the client has a channel's values at all updates, or no value that is wrong.
  void expect_channels(const ClientSession& session, const std::vector<std::string>& complete) const {
    const StreamClient& client = *session.mesh();
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const ChannelValues& held = client.channels()[i];
      ASSERT_EQ(testing::wrong_value(held, channels[i], client.front()), "");
      if (std::find(complete.begin(), complete.end(), held.channel().name) == complete.end()) continue;
      EXPECT_EQ(held.groups(), client.front().splits()) << held.channel().name;
    }
  }

  // The mesh of each range is that of a fresh client that asks for this range alone. At an error above 0 it is if the
  // client holds no more than its view wants.
  void expect_each(const ClientSession& session, const ViewRequest& view) const {
    const ShownRanges shown = resolve(volume->description(), view.shown);
    ASSERT_EQ(session.mesh()->fronts().size(), shown.size());
    std::uint64_t updates = 0;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const auto expected = extract(*volume, *find_relevant_updates(volume, {shown[i]}, Distances::none), view.lod);
      ASSERT_TRUE(expected);
      EXPECT_EQ(mesh_digest(session.mesh()->fronts()[i].mesh()), mesh_digest(expected->front.mesh())) << "range " << i << " of " << shown.size();
      updates += expected->updates;
    }
    EXPECT_EQ(session.mesh()->updates_in_mesh(), updates);
  }

  void expect_valid(const ClientSession& session) {
    expect_channels(session, {});
    for (const Front& front : session.mesh()->fronts()) {
      ASSERT_EQ(front.validate().value_or(""), "");
      if (random() % 4 != 0) continue;  // this is slow
      ASSERT_EQ(testing::broken_law(front.mesh(), field.volume.grid, front.range().alpha == front.range().beta), "");
    }
  }

  // Slots by supercube.
  using Updates = std::map<SupercubeKey, std::uint64_t>;
  [[nodiscard]] static Updates updates_of(const ClientSession& session) {
    Updates updates;
    for (const SlotGroup& group : session.mesh()->front().splits()) updates[group.key] = group.slots;
    return updates;
  }
  [[nodiscard]] static std::uint64_t count(const Updates& updates) {
    std::uint64_t count = 0;
    for (const auto& [key, slots] : updates) count += std::uint64_t(std::popcount(slots));
    return count;
  }

  testing::ValueField field = testing::random_value_field(kBoxes[GetParam() % 4], GetParam());
  std::mt19937 random{GetParam()};
  std::array<Volume, 2> channels{testing::noise(field.volume.grid.dims, 1, 300, GetParam()), testing::places(field.volume.grid.dims)};
  std::shared_ptr<const IntervalVolume> volume = make_volume();
};

TEST_P(RangeStream, EndsWithTheMeshOfAFreshClient) {
  ClientSession session({.dataset = "made", .client = "test"});
  session.look(random_view());
  for (int connection = 0; connection < 3; ++connection) {
    testing::SessionServer server(volume, session);
    for (int i = 0; i < 4; ++i) {
      server.run(int(random() % 6));
      if (random() % 2 == 0) {  // asks for nothing, and what is on its way still fits
        const std::uint64_t epoch = session.epoch();
        ASSERT_TRUE(session.preview(random_request()));
        EXPECT_EQ(session.epoch(), epoch);
        server.run(int(random() % 3));
      }
      if (session.mesh() != nullptr) expect_valid(session);
      ASSERT_TRUE(session.look(random_view()));
    }
    server.run();
    ViewRequest whole;
    whole.shown = random_request();
    whole.channels = random_view().channels;
    ASSERT_TRUE(session.look(whole));
    server.run();
    EXPECT_EQ(session.state(), ClientSession::State::idle);
    expect_each(session, whole);
    expect_channels(session, whole.channels);
    EXPECT_EQ(session.mesh()->updates(), session.stats().updates) << "an update was sent twice";
    session.disconnected();
  }
}

TEST_P(RangeStream, KeepsItsBudgetsAndForgets) {
  ClientSession session({.dataset = "made", .client = "test"});
  session.look(random_view());
  testing::SessionServer server(volume, session);
  server.run(2);
  const std::uint64_t room = 40 + volume->size() / 8;
  for (int i = 0; i < 6; ++i) {
    ViewRequest view = random_view();
    view.lod.max_updates.reset();
    view.camera = testing::random_camera(volume->description().grid, random);
    view.budget = {.max_tets = 200 + random() % 2000, .max_updates = room};
    ASSERT_TRUE(session.look(view));
    server.run(1 + int(random() % 4));
    expect_valid(session);
    server.run();
    expect_channels(session, view.channels);
    EXPECT_LE(session.mesh()->updates(), room);
    std::uint64_t roots = 0;  // no budget makes meshes smaller than the patches of the root
    for (const ShownRange& shown : resolve(volume->description(), view.shown)) roots += root_front(volume->description(), shown).tet_count();
    EXPECT_LE(session.mesh()->tet_count(), std::max(view.budget.max_tets, roots));
    session.look_again();
    server.run();
  }
  ViewRequest whole;
  whole.shown = random_request();
  whole.channels = {"noise"};
  ASSERT_TRUE(session.look(whole));
  server.run();
  expect_each(session, whole);
  expect_channels(session, whole.channels);
}

// Switched on, off and on again, one by one and together: what is here already is not sent again.
TEST_P(RangeStream, AChannelComesForUpdatesThatAreHereAlready) {
  ClientSession session({.dataset = "made", .client = "test"});
  ViewRequest view;
  view.shown = random_request();
  session.look(view);
  testing::SessionServer server(volume, session);
  server.run();
  const std::uint64_t updates = session.mesh()->updates();
  for (const std::vector<std::string>& names : std::vector<std::vector<std::string>>{{"place"}, {"noise", "place"}, {}, {"noise"}}) {
    view.channels = names;
    ASSERT_TRUE(session.look(view));
    const std::uint64_t messages = session.stats().messages;
    server.run();
    expect_channels(session, names);
    EXPECT_EQ(session.stats().updates, updates);
    for (const Mesh& mesh : session.mesh()->meshes()) EXPECT_EQ(mesh.channels.size(), names.size());
    const bool has_all = names.empty() || names == std::vector<std::string>{"noise"};
    EXPECT_TRUE(!has_all || session.stats().messages == messages + 1) << "something but Done";
  }
  view.channels = {"nothing"};
  const auto refused = session.look(view);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().usage);
}

// At any error, and with a budget and a camera the meshes of extract().
TEST_P(RangeStream, AFreshClientHasTheMeshesOfItsRanges) {
  for (int trial = 0; trial < 4; ++trial) {
    ClientSession session({.dataset = "made", .client = "test"});
    ViewRequest view;
    view.shown = random_request();
    view.lod.error_percent = double(random() % 40);
    ASSERT_TRUE(session.look(view));
    testing::SessionServer server(volume, session);
    server.run();
    expect_valid(session);
    expect_each(session, view);

    const ViewRequest seen = [&] {
      ViewRequest with = random_view();
      with.shown = view.shown;
      with.early = false;
      with.coarse_error_percent.reset();
      return with;
    }();
    ClientSession other({.dataset = "made", .client = "test"});
    ASSERT_TRUE(other.look(seen));
    testing::SessionServer again(volume, other);
    again.run();
    const ShownRanges shown = resolve(volume->description(), seen.shown);
    const auto expected = extract(*volume, *find_relevant_updates(volume, shown, Distances::measured), shown, seen.lod);
    ASSERT_TRUE(expected);
    for (std::size_t i = 0; i < shown.size(); ++i)
      EXPECT_EQ(mesh_digest(other.mesh()->fronts()[i].mesh()), mesh_digest((*expected)[i].front.mesh())) << "range " << i;
  }
}

// What is on its way is the same for ranges in another order, and with one of them twice.
TEST_P(RangeStream, OrderAndRepetitionDoNotMatterToTheServer) {
  ViewRequest view = random_view();
  view.early = false;
  ClientSession one({.dataset = "made", .client = "test"}), other({.dataset = "made", .client = "test"});
  ASSERT_TRUE(one.look(view));
  std::shuffle(view.shown.ranges.begin(), view.shown.ranges.end(), random);
  if (view.shown.ranges.size() < kMaxRanges) view.shown.ranges.push_back(view.shown.ranges.front());
  ASSERT_TRUE(other.look(view));
  testing::SessionServer a(volume, one), b(volume, other);
  a.run();
  b.run();
  EXPECT_EQ(one.stats().bytes, other.stats().bytes);
  EXPECT_EQ(one.mesh()->updates(), other.mesh()->updates());
}

// What an early view ends with has everything that the same view wants otherwise.
TEST_P(RangeStream, AnEarlyViewIsNoCoarser) {
  ClientSession session({.dataset = "made", .client = "test"});
  session.look({});
  testing::SessionServer server(volume, session);
  server.run(1);
  for (int i = 0; i < 4; ++i) {
    ViewRequest view = random_view();
    view.early = true;
    ASSERT_TRUE(session.look(view));
    server.run();
    expect_valid(session);
    const std::uint64_t updates = session.mesh()->updates();
    view.early = false;
    ASSERT_TRUE(session.look(view));
    server.run();
    EXPECT_EQ(session.mesh()->updates(), updates);
  }
}

// They come, each once, as far as the client's budgets allow: after Done, but for those with great errors, which may come
// before.
TEST_P(RangeStream, CoarseUpdatesOfEveryRangeFollowDone) {
  ViewRequest view = random_view();
  view.early = false;  // what estimates send depends on time
  view.coarse_error_percent.reset();
  if (GetParam() % 2 == 0) {
    view.lod.camera = testing::random_camera(volume->description().grid, random);
    view.lod.camera->pixel_error = std::pow(2.0, testing::uniform(random, -5, 3));
    view.lod.max_updates.reset();
  } else if (random() % 4 == 0) {
    view.budget.max_updates = 20 + random() % volume->size();
  }
  ClientSession without({.dataset = "made", .client = "test"}), with({.dataset = "made", .client = "test"}),
      whole({.dataset = "made", .client = "test"});
  ASSERT_TRUE(without.look(view));
  const double percent = view.coarse_error_percent.emplace(double(random() % 40));
  ASSERT_TRUE(with.look(view));
  testing::SessionServer one(volume, without), other(volume, with);
  one.run();
  while (with.state() != ClientSession::State::idle) ASSERT_NO_FATAL_FAILURE(other.run(1));
  EXPECT_EQ(with.stats().is_full, without.stats().is_full);
  ViewRequest coarse;
  coarse.shown = {{volume->description().range}, Refine::uniform};
  testing::SessionServer third(volume, whole);
  const auto with_coarse = [&](double error_percent) {
    Updates updates = updates_of(without);
    if (!volume->description().has_every_range) return updates;
    coarse.lod.error_percent = error_percent;
    EXPECT_TRUE(whole.look(coarse));
    third.run();
    for (const auto& [key, slots] : updates_of(whole)) updates[key] |= slots;
    return updates;
  };
  const bool is_ahead = updates_of(with) != updates_of(without);
  const bool may_be_ahead = view.lod.camera && view.lod.camera->pixel_error < 16 && !view.lod.max_updates;
  if (is_ahead) {
    EXPECT_EQ(updates_of(with), with_coarse(std::max(percent, 40.0)));
    EXPECT_TRUE(may_be_ahead);
  } else if (!may_be_ahead) {  // otherwise they may have been looked for in vain, and the batches are others
    EXPECT_EQ(with.stats().bytes, without.stats().bytes);
  }
  other.run();
  expect_valid(with);
  EXPECT_EQ(with.stats().updates, with.mesh()->updates()) << "an update was sent twice";

  const Updates expected = with_coarse(percent);
  const std::uint64_t room = view.budget.max_updates;
  const std::uint64_t most = std::max(without.mesh()->updates(), std::min(room - room / 4, view.lod.max_updates.value_or(UINT64_MAX)));
  if (count(expected) > most) {
    EXPECT_LE(with.mesh()->updates(), most);
    return;
  }
  EXPECT_EQ(updates_of(with), expected);

  // Whatever range is looked at, nothing is missing at that error, and nothing follows twice.
  for (int i = 0; i < 3; ++i) {
    ViewRequest next;
    next.shown = random_request();
    next.lod.error_percent = percent;
    next.coarse_error_percent = percent;
    ASSERT_TRUE(with.look(next));
    other.run();
  }
  EXPECT_EQ(with.mesh()->updates(), volume->description().has_every_range ? count(expected) : with.stats().updates);
}

TEST_P(RangeStream, RefusesMoreRangesThanCanBeShown) {
  ClientSession session({.dataset = "made", .client = "test"});
  session.look({});
  testing::SessionServer server(volume, session);
  server.run();
  ViewRequest five;
  five.shown.ranges.assign(kMaxRanges + 1, volume->description().range);
  const auto refused = session.look(five);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().usage);
  EXPECT_EQ(session.mesh()->fronts().size(), 1u);
}

TEST_P(RangeStream, RefusesARangeThatTheDataSetHasNot) {
  const Description& d = volume->description();
  ClientSession session({.dataset = "made", .client = "test"});
  session.look({});
  testing::SessionServer server(volume, session);
  server.run();
  ViewRequest beyond;
  if (std::isfinite(d.range.alpha)) beyond.shown.ranges = {{std::nextafter(d.range.alpha, -kInf), d.range.beta}};
  if (std::isfinite(d.range.beta)) beyond.shown.ranges = {{d.range.alpha, std::nextafter(d.range.beta, kInf)}};
  if (beyond.shown.ranges.empty()) return;  // it has every range
  const auto refused = session.look(beyond);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().usage);
  EXPECT_EQ(session.mesh()->front().range(), d.range);
}

INSTANTIATE_TEST_SUITE_P(Random, RangeStream, testing::seeds(0, 24));

}  // namespace
}  // namespace intervale
