// Sessions whose range changes while they receive.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <utility>

#include "client/core/client_session.h"
#include "common/ivm/every_range.h"
#include "common/ivm/extraction.h"
#include "common/mesh/mesh_digest.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/find_relevant_updates.h"
#include "server/builder/value_builder.h"
#include "tests/support/cameras.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/session_server.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

class RangeStream : public ::testing::TestWithParam<unsigned> {
 public:
  static constexpr std::array<std::array<std::int32_t, 3>, 4> kBoxes{{{17, 17, 17}, {9, 7, 5}, {17, 12, 13}, {6, 21, 4}}};

  // Of every range, or refined uniformly.
  [[nodiscard]] std::shared_ptr<const IntervalVolume> make_volume() {
    Volume samples = field.volume;
    samples.name = "made";
    if (GetParam() % 3 != 0) return std::make_shared<const IntervalVolume>(*of_every_range(build_value_volume(samples, field.format).take()));
    return std::make_shared<const IntervalVolume>(*FieldHierarchy(samples, {testing::random_range(field, random), Refine::uniform}).compact());
  }

  // Within the data set's.
  [[nodiscard]] RangeRequest random_request() {
    const Range& whole = volume->description().range;
    Range range = testing::random_range(field, random);
    range = {std::clamp(range.alpha, whole.alpha, whole.beta), std::clamp(range.beta, whole.alpha, whole.beta)};
    return {range, random() % 3 == 0 ? Refine::uniform : Refine::boundary};
  }

  [[nodiscard]] ViewRequest random_view() {
    ViewRequest view;
    view.shown = random_request();
    if (random() % 2 == 0) view.lod.error_percent = double(random() % 40);
    if (random() % 3 == 0) view.lod.max_updates = random() % (volume->size() + 10);
    if (random() % 3 == 0) {
      view.lod.camera = testing::random_camera(volume->description().grid, random);
      view.lod.camera->pixel_error = double(1 + random() % 64);
    }
    return view;
  }

  void expect_whole(const ClientSession& session, const RangeRequest& request) const {
    const ShownRange shown = resolve(volume->description(), request);
    const auto expected = extract(*volume, *find_relevant_updates(volume, shown, false), {});
    ASSERT_TRUE(expected);
    EXPECT_EQ(mesh_digest(session.mesh()->mesh()), mesh_digest(expected->front.mesh()));
    EXPECT_EQ(session.mesh()->updates_in_mesh(), expected->updates);
  }

  testing::ValueField field = testing::random_value_field(kBoxes[GetParam() % 4], GetParam());
  std::mt19937 random{GetParam()};
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
      if (session.mesh() != nullptr) {
        ASSERT_EQ(session.mesh()->front().validate().value_or(""), "");
      }
      ASSERT_TRUE(session.look(random_view()));
    }
    server.run();
    ViewRequest whole;
    whole.shown = random_request();
    ASSERT_TRUE(session.look(whole));
    server.run();
    EXPECT_EQ(session.state(), ClientSession::State::idle);
    expect_whole(session, whole.shown);
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
    ASSERT_EQ(session.mesh()->front().validate().value_or(""), "");
    server.run();
    EXPECT_LE(session.mesh()->updates(), room);
    session.look_again();
    server.run();
  }
  ViewRequest whole;
  whole.shown = random_request();
  ASSERT_TRUE(session.look(whole));
  server.run();
  expect_whole(session, whole.shown);
}

TEST_P(RangeStream, RefusesARangeThatTheDataSetHasNot) {
  const Description& d = volume->description();
  ClientSession session({.dataset = "made", .client = "test"});
  session.look({});
  testing::SessionServer server(volume, session);
  server.run();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ViewRequest beyond;
  if (std::isfinite(d.range.alpha)) beyond.shown.range = Range{std::nextafter(d.range.alpha, -kInfinity), d.range.beta};
  if (std::isfinite(d.range.beta)) beyond.shown.range = Range{d.range.alpha, std::nextafter(d.range.beta, kInfinity)};
  if (!beyond.shown.range) return;  // it has every range
  const auto refused = session.look(beyond);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().usage);
  EXPECT_EQ(session.mesh()->front().range(), d.range);
}

INSTANTIATE_TEST_SUITE_P(Random, RangeStream, ::testing::Range(0u, 24u));

}  // namespace
}  // namespace intervale
