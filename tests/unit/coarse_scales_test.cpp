// The beginning of a file is the data set as far as to some scale; a session that has begun with it ends as any other.
#include "common/ivm/coarse_scales.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "client/local/fetch_local.h"
#include "common/ivm/distance_codes.h"
#include "common/ivm/extraction.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/mesh/mesh_digest.h"
#include "common/parallel/all_cores.h"
#include "common/ranges/extract_meshes.h"
#include "common/view/screen_error.h"
#include "protocol/codec.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"
#include "server/builder/value_builder.h"
#include "tests/support/seeds.h"
#include "tests/support/value_fields.h"

namespace intervale::coarse_scaless {
namespace {

using Dims = std::array<std::int32_t, 3>;
using SharedVolume = std::shared_ptr<const IntervalVolume>;
using Bytes = std::vector<std::byte>;

Bytes file_of(const Dims& dims, unsigned seed) {
  Volume volume = testing::random_value_field(dims, seed).volume;
  const testing::ValueField field = testing::random_value_field(dims, seed);
  return encode_values(build_value_volume(volume, field.format), on_all_cores);
}

std::vector<CoarseScales> scales_of(const Bytes& file) {
  const auto scales = coarse_scales(std::span(file).first(std::min(file.size(), kStartBytes)), file.size());
  EXPECT_TRUE(scales) << scales.error().message;
  return scales ? *scales : std::vector<CoarseScales>();
}

FileEnds ends_of(const Bytes& file, const CoarseScales& scales) {
  return {std::span(file).first(scales.first_bytes), std::span(file).last(scales.last_bytes), file.size()};
}

SharedVolume coarse(const Bytes& file, const CoarseScales& scales) {
  auto volume = decode_coarse(ends_of(file, scales), scales, "made", on_all_cores);
  EXPECT_TRUE(volume) << volume.error().message;
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

SharedVolume whole(const Bytes& file) { return std::make_shared<const IntervalVolume>(decode_volume(file, "made", on_all_cores).value()); }

// Of several pages, in one scale or two that can be had before the rest.
constexpr std::array<std::pair<Dims, unsigned>, 3> kFiles{{{{300, 60, 20}, 4}, {{70, 67, 66}, 0}, {{134, 130, 129}, 1}}};
const Bytes& large() {
  static const Bytes file = std::apply(file_of, kFiles.back());
  return file;
}

TEST(CoarseScales, AreTheSameUpdatesAsThoseOfTheWholeFile) {
  for (const auto& made : std::span(kFiles).first(testing::cases(kFiles.size()))) {
    const Bytes file = std::apply(file_of, made);
    const SharedVolume all = whole(file);
    EXPECT_TRUE(all->is_whole());
    std::size_t before = 0;
    for (const CoarseScales& scales : scales_of(file)) {
      const SharedVolume some = coarse(file, scales);
      EXPECT_FALSE(some->is_whole());
      EXPECT_GT(some->size(), before);
      before = some->size();
      EXPECT_EQ(some->description(), all->description());
      ASSERT_LE(some->set().supercubes(), all->set().supercubes());
      EXPECT_TRUE(std::ranges::equal(some->set().occupancy(), all->set().occupancy().first(some->set().supercubes())));
      for (UpdateIndex i{0}; i < some->size(); ++i) {
        ASSERT_EQ(some->key(i), all->key(i));
        ASSERT_EQ(some->error(i), all->error(i));
      }
      EXPECT_EQ(some->set().of_scale(scales.finest - 1)[0], some->set().bricks().size()) << "no finer scales";
    }
    EXPECT_GT(before, 0U);
  }
}

TEST(CoarseScales, TheirMeshIsThatOfTheWholeFileWhereNothingFinerIsWanted) {
  const SharedVolume all = whole(large());
  for (const CoarseScales& scales : scales_of(large())) {
    const SharedVolume some = coarse(large(), scales);
    Lod lod;
    for (UpdateIndex i{some->size()}; i < all->size(); ++i) lod.error = std::max(lod.error, double(all->error(i)));
    const ShownRanges shown{{{-0.4, 0.3}, Refine::boundary}};
    const auto one = extract_meshes(some, shown, lod, {}, on_all_cores), other = extract_meshes(all, shown, lod, {}, on_all_cores);
    ASSERT_TRUE(one && other);
    EXPECT_GT((*one)[0].mesh.tets.size(), 0U);
    EXPECT_EQ(mesh_digest((*one)[0].mesh), mesh_digest((*other)[0].mesh));
  }
}

// The largest error of a scale's last level bounds those of all finer scales, whatever the box cuts.
TEST(CoarseScales, ErrorsOfTheLastLevelOfAScaleBoundThoseOfFinerOnes) {
  for (const Dims& dims :
       std::vector<Dims>{{33, 33, 33}, {40, 21, 35}, {70, 67, 66}, {65, 9, 30}, {2, 50, 7}, {37, 2, 2}, {18, 17, 100}, {3, 3, 66}}) {
    for (unsigned seed = 0; seed < testing::cases(5); ++seed) {
      const SharedVolume all = whole(file_of(dims, seed));
      const SupercubeSet& set = all->set();
      const auto largest = [&](int scale, int cls) {
        double error = 0;
        set.for_each(scale, cls, [&](const Place& p) { error = std::max(error, double(all->error(p.index))); });
        return error;
      };
      double finer = 0;
      for (int scale = 0; scale < all->domain().levels(); ++scale) {
        for (const int cls : {2, 1, 0}) {
          EXPECT_GE(largest(scale, cls), finer) << dims[0] << "x" << dims[1] << "x" << dims[2] << " field " << seed << " scale " << scale << " level "
                                                << cls;
          finer = std::max(finer, largest(scale, cls));
        }
      }
    }
  }
}

TEST(CoarseScales, WantFinerOnesWhereTheirErrorsAreAboveTheThreshold) {
  for (const auto& made : std::span(kFiles).first(testing::cases(kFiles.size()))) {
    const Bytes file = std::apply(file_of, made);
    const SharedVolume all = whole(file);
    EXPECT_FALSE(wants_finer(*all, {}));
    for (const CoarseScales& scales : scales_of(file)) {
      const SharedVolume some = coarse(file, scales);
      EXPECT_TRUE(wants_finer(*some, {})) << "error 0 wants all";
      EXPECT_FALSE(wants_finer(*some, {.error_percent = 100}));
      EXPECT_TRUE(wants_finer(*some, {.error_percent = 100, .camera = Camera{}})) << "distances need the whole data set";
      for (const float step : all->error_steps()) {
        bool is_finer_wanted = false, is_last_level_above = false;
        for (UpdateIndex i{some->size()}; i < all->size(); ++i) is_finer_wanted = is_finer_wanted || all->error(i) > step;
        some->set().for_each(scales.finest, 2, [&](const Place& p) { is_last_level_above = is_last_level_above || some->error(p.index) > step; });
        if (step > 0) {
          EXPECT_EQ(wants_finer(*some, {.error = step}), is_last_level_above);
        }
        EXPECT_TRUE(wants_finer(*some, {.error = step}) || !is_finer_wanted) << "error " << step;
      }
    }
  }
}

// A camera wants no scale of whose diamonds half the width is within its pixel error, wherever they are.
TEST(CoarseScales, EstimatesWantFinerOnesWhereTheirDiamondsAreLargeOnTheScreen) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-200, 300), within(0, 1);
  for (const auto& made : std::span(kFiles).first(testing::cases(kFiles.size()))) {
    const Bytes file = std::apply(file_of, made);
    const SharedVolume all = whole(file);
    const Grid& grid = all->description().grid;
    const Box box = box_of(grid);
    for (const CoarseScales& scales : scales_of(file)) {
      const SharedVolume some = coarse(file, scales);
      const double half_width = std::ldexp(diamond_width(grid), scales.finest - 1) / 2;
      int wanting = 0;
      for (int i = 0; i < 200; ++i) {
        Lod lod;
        lod.camera = Camera{.eye = {anywhere(random), anywhere(random), anywhere(random)}, .look_at = {33, 30, 10}, .viewport = {640, 480}};
        lod.camera->pixel_error = std::exp(8 * within(random) - 2);
        EXPECT_FALSE(estimates_want_finer(*all, lod));
        const bool is_wanted = estimates_want_finer(*some, lod);
        wanting += int(is_wanted);
        EXPECT_FALSE(estimates_want_finer(*some, {.error_percent = 100, .camera = lod.camera})) << "the error is enough";
        Lod finer = lod;
        finer.camera->pixel_error /= 2;
        EXPECT_TRUE(!is_wanted || estimates_want_finer(*some, finer));
        if (is_wanted) continue;
        const ScreenError screen(*lod.camera, grid);
        for (int point = 0; point < 50; ++point) {
          ScreenError::Region region;
          for (std::size_t axis = 0; axis < 3; ++axis) region.middle[axis] = within(random) * double(grid.dims[axis] - 1);
          EXPECT_LE(half_width * screen.pixels_per_unit(region), lod.camera->pixel_error);
        }
      }
      EXPECT_GT(wanting, 20);
      EXPECT_LT(wanting, 180);
      EXPECT_EQ(estimates_want_finer(*some, {.roi = box}), wants_finer(*some, {.roi = box}));
      EXPECT_EQ(estimates_want_finer(*some, {.error_percent = 40}), wants_finer(*some, {.error_percent = 40}));
    }
  }
}

// Any range, refined in any way: what finer values make relevant besides is not shown.
TEST(CoarseScales, EndAFetchOnceNothingFinerIsWanted) {
  std::mt19937 random(3);
  std::size_t ended = 0;
  constexpr std::array kSeeds{0U, 1U, 2U, 4U};
  for (const unsigned seed : std::span(kSeeds).first(testing::cases(kSeeds.size()))) {
    const Dims dims{70, 67, 66};
    const testing::ValueField field = testing::random_value_field(dims, seed);
    const Bytes file = file_of(dims, seed);
    const SharedVolume all = whole(file), some = coarse(file, scales_of(file).front());
    double least = 0;  // threshold
    some->set().for_each(scales_of(file).front().finest, 2, [&](const Place& p) { least = std::max(least, double(some->error(p.index))); });
    for (int n = 0; n < 6; ++n) {
      FetchOptions options;
      options.lod.error = n % 3 == 0 ? least : n % 3 == 1 ? least * 1.3 : least / 2;
      options.shown = {{testing::random_range(field, random)}, n % 4 == 1 ? Refine::uniform : Refine::boundary};
      if (n % 5 == 0) options.shown.ranges.push_back(testing::random_range(field, random));
      bool is_whole = false;
      const auto read = [&](ReadOn how, const ParallelFor&) -> Result<SharedVolume> {
        EXPECT_EQ(how, ReadOn::one_scale);
        return std::exchange(is_whole, true) ? all : some;
      };
      int reads = 0;
      const auto growing =
          fetch_growing([&](ReadOn how, const ParallelFor& parallel) { return ++reads, read(how, parallel); }, options, {}, on_all_cores);
      const auto at_once = fetch_local(all, options, {});
      ASSERT_TRUE(growing && at_once);
      EXPECT_TRUE(growing->stats.is_complete);
      EXPECT_EQ(reads, wants_finer(*some, options.lod) ? 2 : 1);
      ended += reads == 1 ? 1 : 0;
      const auto one = growing->client.meshes(), other = at_once->client.meshes();
      ASSERT_EQ(one.size(), other.size());
      for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(mesh_digest(one[i]), mesh_digest(other[i])) << seed << " " << n;
      EXPECT_EQ(growing->client.updates_in_mesh(), at_once->client.updates_in_mesh());
    }
  }
  EXPECT_GT(ended, 2 * testing::cases(4));
}

TEST(CoarseScales, AreFewOfTheBytes) {
  const std::vector<CoarseScales> scales = scales_of(large());
  ASSERT_EQ(scales.size(), 2U);
  EXPECT_LT(scales[0].first_bytes + scales[0].last_bytes, large().size() / 20);
  EXPECT_LT(scales[1].first_bytes + scales[1].last_bytes, large().size() / 4);
  EXPECT_TRUE(scales_of(file_of({9, 7, 5}, 0)).empty()) << "a single page";
}

TEST(CoarseScales, TellHowMuchMemoryTheyTake) {
  const Bytes file = file_of({134, 130, 129}, 3);
  const auto decode = [&](std::uint64_t room) { return decode_volume(file, "made", serial, room); };
  const Description d = whole(file)->description();
  const std::uint64_t all = memory_to_decode(d.grid, d.format.last);
  EXPECT_TRUE(decode(all));
  EXPECT_THROW((void)decode(all - 1), NoRoom);
  EXPECT_GE(all, whole(file)->memory_bytes());
  for (const CoarseScales& scales : scales_of(file)) {
    const std::uint64_t some = memory_to_decode(d.grid, d.format.last, scales.finest);
    EXPECT_GE(some, coarse(file, scales)->memory_bytes());
    EXPECT_LT(some, all / 6);
  }
}

TEST(CoarseScales, NeedTheIndexOfThePages) {
  const auto scales = scales_of(large());
  const auto index = place_of(StreamType::page_index, large(), large().size(), FileScope::every_range).value();
  const std::uint64_t end = index.offset + index.bytes;
  for (const std::size_t there : {std::size_t(400), std::size_t(end) - 1, std::size_t(end), kStartBytes}) {
    const auto start = std::span(large()).first(there);
    EXPECT_EQ(start_bytes(start, large().size()), std::max<std::uint64_t>(end, there));
    const auto found = coarse_scales(start, large().size());
    ASSERT_TRUE(found);
    EXPECT_EQ(found->size(), there < end ? 0 : scales.size());
  }
  Bytes damaged = large();
  damaged[100] ^= std::byte(1);
  EXPECT_EQ(start_bytes(std::span(damaged).first(400), damaged.size()), 400U);
}

TEST(CoarseScales, RefuseWhatIsDamagedCutShortOrNoFile) {
  const Bytes file = file_of({70, 67, 66}, 0);
  const CoarseScales scales = scales_of(file).front();
  for (std::size_t i = 0; i < scales.first_bytes; i += i < 700 ? 3 : 1997) {
    Bytes changed = file;
    changed[i] ^= std::byte(1 << i % 8);
    EXPECT_FALSE(decode_coarse(ends_of(changed, scales), scales, "changed")) << "byte " << i;
  }
  for (std::size_t i = 1; i <= scales.last_bytes; i += 5) {
    Bytes changed = file;
    changed[file.size() - i] ^= std::byte(1);
    EXPECT_FALSE(decode_coarse(ends_of(changed, scales), scales, "changed")) << "byte " << i << " from the end";
  }
  CoarseScales less = scales;
  --less.first_bytes;
  EXPECT_FALSE(decode_coarse(ends_of(file, less), scales, "short"));
  less = scales;
  --less.last_bytes;
  EXPECT_FALSE(decode_coarse(ends_of(file, less), scales, "short"));
  EXPECT_FALSE(decode_coarse({std::span(file), std::span(file), file.size()}, scales, "long"));
  EXPECT_FALSE(coarse_scales(std::span(file).first(kStartBytes), file.size() - 1));
  EXPECT_FALSE(coarse_scales(std::span(file).first(20), file.size()));
  EXPECT_FALSE(coarse_scales({}, 0));
  EXPECT_TRUE(scales_of(Bytes(file.begin(), file.end())).size() == 1);
  const auto within = coarse_scales(std::span(file).first(600), file.size());
  EXPECT_TRUE(within && within->empty()) << "the index is not there";
}

// A client and the sending side, which has begun with coarse scales.
struct GrowingSession {
  explicit GrowingSession(SharedVolume volume, SessionState::Growth growth = SessionState::Growth::by_itself)
      : found(std::move(volume)),
        server([this](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return found; }, worker, growth) {
    client.connected({});
  }

  // Until nothing is left to do, or so many messages were sent to the client.
  void run(int messages = 1 << 20) {
    while (messages > 0) {
      for (const auto& bytes : client.take_messages()) {
        const auto message = protocol::decode_client_message(bytes);
        ASSERT_TRUE(message);
        const auto fault = server.receive(*message);
        ASSERT_FALSE(fault) << fault->text;
      }
      const auto message = server.next();
      if (!message) {
        if (server.has_work() || (server.waits() && worker.work())) continue;
        return;
      }
      ASSERT_TRUE(client.receive(protocol::encode(*message), {}));
      --messages;
    }
  }

  SharedVolume found;
  LocalWorker worker;
  SessionState server;
  ClientSession client{{.dataset = "made", .client = "test"}};
};

ViewRequest view_of(const Range& range, double pixels) {
  ViewRequest view;
  view.lod.camera = Camera{.eye = {150, 130, 125}, .look_at = {33, 32, 32}, .viewport = {640, 480}, .pixel_error = pixels};
  view.shown = {{range}, Refine::boundary};
  view.early = true;
  return view;
}

TEST(CoarseScales, ASessionThatBeginsWithThemEndsWithTheMeshOfTheWholeFile) {
  const Bytes file = file_of({70, 67, 66}, 1);
  const SharedVolume all = whole(file);
  std::vector<SharedVolume> growing;
  for (const CoarseScales& scales : scales_of(file)) growing.push_back(coarse(file, scales));
  ASSERT_EQ(growing.size(), 1U);
  growing.push_back(all);
  constexpr std::array kUsesCamera{true, false};
  for (const bool uses_camera : std::span(kUsesCamera).first(testing::cases(kUsesCamera.size()))) {
    ViewRequest view = view_of({1.25, kInf}, 1);
    if (!uses_camera) view.lod = {.error_percent = 2};
    GrowingSession at_once(all);
    ASSERT_TRUE(at_once.client.look(view));
    at_once.run();
    ASSERT_EQ(at_once.client.state(), ClientSession::State::idle);
    for (const int messages : {1, 1 << 20}) {
      GrowingSession session(growing[0]);
      ASSERT_TRUE(session.client.look(view));
      std::uint64_t before = 0;
      for (const SharedVolume& volume : growing) {
        session.found = volume;
        session.run(volume == all ? 1 << 20 : messages);
        if (messages == 1) continue;  // that the data set was opened is the first
        EXPECT_GT(session.client.mesh()->updates(), before) << "each scale more shows more";
        before = session.client.mesh()->updates();
        EXPECT_EQ(session.client.state() == ClientSession::State::idle, volume == all) << "Done comes from the whole data set";
      }
      EXPECT_EQ(session.client.state(), ClientSession::State::idle);
      EXPECT_EQ(session.client.mesh()->description().updates, all->size());
      ViewRequest rest = view;  // what is sent by estimates may differ, but not all of it
      rest.lod = {.error = 0};
      for (GrowingSession* each : {&session, &at_once}) {
        ASSERT_TRUE(each->client.look(rest));
        each->run();
      }
      EXPECT_EQ(mesh_digest(session.client.mesh()->mesh()), mesh_digest(at_once.client.mesh()->mesh()));
    }
  }
}

TEST(CoarseScales, AViewIsDoneWithThemIfNothingMoreComes) {
  const Bytes file = file_of({70, 67, 66}, 1);
  for (const bool is_early : {true, false}) {
    GrowingSession session(coarse(file, scales_of(file)[0]));
    ViewRequest view = view_of({1.25, kInf}, 1);
    view.early = is_early;
    ASSERT_TRUE(session.client.look(view));
    session.run();
    EXPECT_NE(session.client.state(), ClientSession::State::idle);
    session.server.end_growth();
    session.run();
    EXPECT_EQ(session.client.state(), ClientSession::State::idle);
    EXPECT_GT(session.client.mesh()->updates(), 0U);
  }
}

TEST(CoarseScales, OnDemandAViewIsDoneWithTheScalesThatItWants) {
  std::vector<SharedVolume> growing;
  for (const CoarseScales& scales : scales_of(large())) growing.push_back(coarse(large(), scales));
  growing.push_back(whole(large()));
  ASSERT_EQ(growing.size(), 3U);
  GrowingSession session(growing[0], SessionState::Growth::on_demand);
  EXPECT_FALSE(session.server.lacks_scales());
  std::size_t there = 0;
  std::uint64_t updates = 0;
  for (const double pixels : {200.0, 12.0, 6.0, 0.5}) {
    ViewRequest view = view_of({1.25, kInf}, pixels);
    view.lod.camera->eye = {400, 350, 300};
    view.lod.camera->look_at = {67, 65, 64};
    view.early = pixels != 12;
    ASSERT_TRUE(session.client.look(view));
    session.run();
    while (session.server.lacks_scales()) {
      EXPECT_NE(session.client.state(), ClientSession::State::idle);
      ASSERT_LT(++there, growing.size());
      EXPECT_EQ(session.server.volume()->size(), growing[there - 1]->size());
      session.found = growing[there];
      session.run();
    }
    EXPECT_EQ(session.client.state(), ClientSession::State::idle) << pixels;
    EXPECT_EQ(estimates_want_finer(*growing[there], view.lod), false);
    EXPECT_TRUE(there == 0 || estimates_want_finer(*growing[there - 1], view.lod)) << "no more is asked for than is wanted";
    EXPECT_GT(session.client.mesh()->updates(), updates);
    updates = session.client.mesh()->updates();
  }
  EXPECT_EQ(there, 2U);
  ViewRequest rest = view_of({1.25, kInf}, 1);
  rest.lod = {.error = 0};
  ASSERT_TRUE(session.client.look(rest));
  session.run();
  GrowingSession at_once(growing.back());
  ASSERT_TRUE(at_once.client.look(rest));
  at_once.run();
  EXPECT_EQ(mesh_digest(session.client.mesh()->mesh()), mesh_digest(at_once.client.mesh()->mesh()));
}

// Who resumes with updates that are not there yet waits for them, and gets the rest: as from a data set that was whole.
TEST(CoarseScales, ASessionThatResumesWaitsForTheScalesThatItHas) {
  const SharedVolume all = whole(large()), first = coarse(large(), scales_of(large())[0]), more = coarse(large(), scales_of(large())[1]);
  ASSERT_LT(first->size(), more->size());
  ASSERT_LT(more->size(), all->size());
  // What the client has: the first 2/3 of all scales.
  std::vector<SlotGroup> groups;
  for (UpdateIndex update; update < all->size() * 2 / 3; ++update) {
    const Place place = all->set().place(update);
    if (groups.empty() || groups.back().key != place.key) groups.push_back({.key = place.key});
    groups.back().slots |= std::uint64_t(1) << place.slot;
  }
  const std::size_t some = groups.size() / 3;
  const std::span<const SlotGroup> span = groups;
  const auto stream = [](SessionState& server) {
    std::uint64_t updates = 0;
    while (const auto message = server.next()) {
      EXPECT_FALSE(std::holds_alternative<protocol::Fault>(*message));
      if (const auto* const batch = std::get_if<protocol::Batch>(&*message)) updates += batch->updates;
    }
    return updates;
  };
  for (const auto growth : {SessionState::Growth::by_itself, SessionState::Growth::on_demand}) {
    SharedVolume there = first;
    LocalWorker worker;
    SessionState server([&there](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return there; }, worker, growth);
    const auto send = [&server](const protocol::ClientMessage& message) { return server.receive(message); };
    EXPECT_FALSE(send(protocol::Open{"made", "test", protocol::kMaxWindow, all->description().content_hash}));
    EXPECT_TRUE(std::get<protocol::Opened>(server.next().value()).resumed);
    for (const auto part : {span.first(some), span.subspan(some, some), span.subspan(2 * some)})
      EXPECT_FALSE(send(protocol::Have{{part.begin(), part.end()}}));
    EXPECT_FALSE(send(protocol::View{1, {}}));
    EXPECT_GT(server.memory_bytes(), groups.size() * sizeof(SlotGroup) / 2);
    EXPECT_FALSE(server.next());
    EXPECT_EQ(server.lacks_scales(), growth == SessionState::Growth::on_demand);
    there = more;
    while (server.next() || server.has_work()) EXPECT_EQ(server.volume()->size(), more->size());
    EXPECT_EQ(server.lacks_scales(), growth == SessionState::Growth::on_demand);
    there = all;
    EXPECT_FALSE(server.next()) << "it has grown";
    std::uint64_t updates = 0;
    while (server.has_work()) updates += stream(server);
    EXPECT_EQ(updates, all->size() - all->size() * 2 / 3);
    EXPECT_FALSE(server.lacks_scales());
  }
}

// What a whole data set has not is a fault, however long it was waited for; so is too much to keep, and another data set.
TEST(CoarseScales, ASessionThatResumesWithWhatDoesNotExistEnds) {
  const SharedVolume all = whole(large()), first = coarse(large(), scales_of(large())[0]);
  const SlotGroup wrong{.key = all->set().place(UpdateIndex{0}).key, .slots = ~std::uint64_t(0)};
  for (const int cause : {0, 1, 2}) {
    SharedVolume there = first;
    LocalWorker worker;
    SessionState server([&there](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return there; }, worker,
                        SessionState::Growth::on_demand);
    EXPECT_FALSE(server.receive(protocol::Open{"made", "test", protocol::kMaxWindow, all->description().content_hash}));
    EXPECT_TRUE(server.next());
    const protocol::Have have{std::vector<SlotGroup>(protocol::kMaxHave, wrong)};
    EXPECT_FALSE(server.receive(have));
    if (cause == 0) {
      there = all;
      EXPECT_FALSE(server.next()) << "it has grown";
      EXPECT_EQ(std::get<protocol::Fault>(server.next().value()).code, protocol::CloseCode::malformed);
    } else if (cause == 1) {
      std::optional<protocol::Fault> fault;
      int sent = 1;
      for (; !fault && sent < 1000; ++sent) fault = server.receive(have);
      EXPECT_GT(sent, 64);
      ASSERT_TRUE(fault);
      EXPECT_EQ(fault->code, protocol::CloseCode::going_away);
    } else {
      there = whole(std::apply(file_of, kFiles.front()));
      EXPECT_EQ(std::get<protocol::Fault>(server.next().value()).code, protocol::CloseCode::going_away);
    }
  }
}

}  // namespace
}  // namespace intervale::coarse_scaless
