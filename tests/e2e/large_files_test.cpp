// Large files of every range are served by their coarse scales at first.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <optional>
#include <random>
#include <stdexcept>
#include <thread>

#include "client/api/live_mesh.h"
#include "common/ivm/value_file.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "server/serve/catalogue_watcher.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/file_server.h"
#include "tests/support/page_damage.h"
#include "tests/support/process.h"
#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale::large_files {
namespace {

using protocol::CloseCode;
using ::testing::HasSubstr;

// Four bytes a sample.
std::vector<std::byte> noise(const std::array<std::int32_t, 3>& dims) {
  // The thread sanitizer takes what oneTBB's threads tell each other for races, and does not come to an end.
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::mt19937 random(1);
  std::vector<float> samples(std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]));
  for (float& v : samples) v = std::ldexp(float(random()), -32);
  Volume volume = testing::volume_of_type(SampleType::f32, dims, samples);
  const auto format = choose_value_format(volume, 0);
  return encode_values(build_value_volume(volume, *format));
}

// In two scales of pages.
const std::vector<std::byte>& large() {
  static const std::vector<std::byte> file = noise({70, 68, 67});
  return file;
}

std::filesystem::path write(const TempDir& folder, const std::vector<std::byte>& bytes, const std::string& name = "large.ivm") {
  return folder.file(name, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

struct LargeFiles : ::testing::Test {
  TempDir folder;
  Memory memory;
};

TEST_F(LargeFiles, AreOpenedByTheirCoarseScales) {
  const auto file = write(folder, large());
  for (const auto& input : {file, file.parent_path()}) {
    CatalogueWatcher watcher({input}, memory);
    const auto volume = watcher.load().value().find("large");
    ASSERT_TRUE(volume);
    EXPECT_FALSE(volume->is_whole());
    EXPECT_LT(volume->size(), 50'000U);
    const auto more = watcher.complete();
    ASSERT_TRUE(more && *more);
    const auto whole = (*more)->find("large");
    EXPECT_TRUE(whole->is_whole());
    EXPECT_EQ(whole->description(), volume->description());
    const auto last = watcher.complete();
    EXPECT_TRUE(last && !*last);
    EXPECT_FALSE(watcher.poll());
  }
}

TEST_F(LargeFiles, AreReadScaleByScaleAndThoseWithFewestUpdatesFirst) {
  write(folder, large());
  write(folder, noise({134, 130, 129}), "larger.ivm");
  const auto server = start();
  CatalogueWatcher watcher({folder.path()}, server->memory());
  auto catalogue = watcher.load().value();
  std::size_t size = catalogue.find("larger")->size();
  EXPECT_FALSE(catalogue.find("larger")->is_whole());
  server->offer(catalogue);
  RawClient client(server->port());
  client.send(protocol::Open{"larger", "test", protocol::kMaxWindow});
  protocol::View view{1, {}};
  view.shown = {{{-1, 2}}, Refine::uniform};
  view.early = true;
  client.send(view);
  const std::uint64_t all = client.expect<protocol::Opened>().description.updates;
  std::uint64_t updates = 0;
  const auto read_on = [&] {
    while (updates < size) updates += client.expect<protocol::Batch>().updates;
    EXPECT_EQ(updates, size);
    catalogue = **watcher.complete();
    server->offer(catalogue);
  };
  read_on();
  EXPECT_GT(catalogue.find("larger")->size(), size) << "its coarse scales have fewer updates than those of the other file";
  EXPECT_FALSE(catalogue.find("larger")->is_whole());
  EXPECT_FALSE(catalogue.find("large")->is_whole());
  size = catalogue.find("larger")->size();
  read_on();
  EXPECT_EQ(catalogue.find("larger")->size(), size);
  EXPECT_TRUE(catalogue.find("large")->is_whole());
  catalogue = **watcher.complete();
  EXPECT_TRUE(catalogue.find("larger")->is_whole());
  server->offer(catalogue);
  EXPECT_EQ(updates + client.stream_to_end(), all);
  EXPECT_FALSE(*watcher.complete());
}

TEST_F(LargeFiles, AreReadWholeAtOnceWhereThatIsAsked) {
  const auto file = write(folder, large());
  EXPECT_TRUE(CatalogueWatcher({file}, memory, true).load().value().find("large")->is_whole()) << "damage would be tolerated";
  Memory little(std::uint64_t(1) << 30);
  EXPECT_TRUE(CatalogueWatcher({file}, little).load().value().find("large")->is_whole()) << "it has to fit";
}

TEST_F(LargeFiles, WhatIsFoundDamagedLaterIsTold) {
  std::vector<std::byte> bytes = large();
  testing::damage_page(bytes, testing::page_count(bytes) - 1);
  const auto file = write(folder, bytes);
  CatalogueWatcher named({file}, memory);
  ASSERT_TRUE(named.load());
  const auto failed = named.complete();
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr("is damaged"));
  CatalogueWatcher folders({file.parent_path()}, memory);
  ASSERT_TRUE(folders.load().value().find("large"));
  const auto rest = folders.complete();
  ASSERT_TRUE(rest && *rest);
  EXPECT_FALSE((*rest)->find("large"));
  EXPECT_FALSE(*folders.complete());
  bytes = large();
  testing::damage_page(bytes, 0);
  write(folder, bytes);
  EXPECT_FALSE(CatalogueWatcher({file}, memory).load());
}

TEST_F(LargeFiles, ASessionGoesOnWithTheRest) {
  const auto server = start();
  CatalogueWatcher watcher({write(folder, large())}, server->memory());
  auto coarse = watcher.load().value();
  const std::uint64_t some = coarse.find("large")->size(), all = coarse.find("large")->description().updates;
  server->offer(std::move(coarse));
  RawClient client(server->port());
  client.send(protocol::Open{"large", "test", protocol::kMaxWindow});
  protocol::View view{1, {}};
  view.shown = {{{-1, 2}}, Refine::uniform};
  view.early = true;
  client.send(view);
  EXPECT_EQ(client.expect<protocol::Opened>().description.updates, all);
  std::uint64_t updates = 0;
  while (updates < some) updates += client.expect<protocol::Batch>().updates;
  EXPECT_EQ(updates, some);
  server->offer(std::move(*watcher.complete().value()));
  EXPECT_EQ(updates + client.stream_to_end(), all);
}

TEST_F(LargeFiles, ASessionEndsWhereTheRestIsDamagedOrAnotherFile) {
  const auto server = start();
  std::vector<std::byte> damaged = large();
  testing::damage_page(damaged, testing::page_count(damaged) - 1);
  for (const bool is_replaced : {false, true}) {
    const auto file = write(folder, damaged);
    CatalogueWatcher watcher({file.parent_path()}, server->memory());
    server->offer(watcher.load().value());
    RawClient client(server->port());
    client.send(protocol::Open{"large", "test", protocol::kMaxWindow});
    client.send(protocol::View{1, {}});
    EXPECT_TRUE(client.expect<protocol::Opened>().description.updates > 0);
    if (is_replaced) std::filesystem::copy_file(buckyball(), file, std::filesystem::copy_options::overwrite_existing);
    server->offer(std::move(*watcher.complete().value()));
    const auto end = client.end();
    EXPECT_EQ(end.code, unsigned(CloseCode::going_away));
    ASSERT_TRUE(end.fault);
    EXPECT_EQ(end.fault->text, "the rest of the data set could not be read");
  }
}

// The finer scales of files are read for sessions that want them (serve --on-demand).
struct OnDemand : LargeFiles {
  // Whether the data set has finer scales than at first.
  static bool is_whole(const Catalogue& catalogue, const std::string& name = "large") { return catalogue.find(name)->is_whole(); }
  ScaleDemand demand;
};

TEST_F(OnDemand, ScalesAreReadOnceASessionWantsThemAndDroppedWhenNoneDoes) {
  write(folder, large());
  write(folder, noise({134, 130, 129}), "larger.ivm");
  for (const bool is_folder : {true, false}) {
    std::vector<std::filesystem::path> inputs{folder.path()};
    if (!is_folder) inputs = {folder / "large.ivm", folder / "larger.ivm"};
    CatalogueWatcher watcher(inputs, memory, false, &demand);
    const auto coarse = watcher.load().value();
    EXPECT_FALSE(is_whole(coarse) || is_whole(coarse, "larger"));
    EXPECT_FALSE(*watcher.complete()) << "nobody wants more";
    EXPECT_FALSE(watcher.poll());
    EXPECT_FALSE(watcher.poll()) << "and nothing has changed";
    std::optional<ScaleDemand::Use> use(std::in_place, demand, "larger");
    EXPECT_FALSE(*watcher.complete());
    const std::size_t size = coarse.find("larger")->size();
    EXPECT_TRUE(use->want(coarse.find("larger").get()));
    const auto more = watcher.complete().value();
    ASSERT_TRUE(more);
    EXPECT_GT(more->find("larger")->size(), size);
    EXPECT_FALSE(is_whole(*more, "larger"));
    EXPECT_FALSE(is_whole(*more)) << "nobody wants that one";
    EXPECT_FALSE(*watcher.complete()) << "one scale more is all that was wanted";
    EXPECT_TRUE(use->want(more->find("larger").get()));
    const auto all = watcher.complete().value();
    ASSERT_TRUE(all);
    EXPECT_TRUE(is_whole(*all, "larger"));
    EXPECT_FALSE(*watcher.complete());
    EXPECT_FALSE(watcher.poll());
    EXPECT_FALSE(watcher.drop_unused({})) << "it is in use";
    use.reset();
    EXPECT_FALSE(watcher.drop_unused(std::chrono::minutes(1))) << "it was a moment ago";
    const auto fewer = watcher.drop_unused({});
    ASSERT_TRUE(fewer);
    EXPECT_EQ(fewer->find("larger")->size(), size);
    EXPECT_FALSE(watcher.drop_unused({}));
    EXPECT_FALSE(*watcher.complete());
    EXPECT_FALSE(watcher.poll());
  }
}

TEST_F(OnDemand, FilesThatComeOrChangeAreServedByTheirCoarseScales) {
  CatalogueWatcher watcher({folder.path()}, memory, false, &demand);
  EXPECT_TRUE(watcher.load().value().volumes().empty());
  for (const auto& bytes : {large(), noise({71, 68, 67})}) {
    std::optional<ScaleDemand::Use> use(std::in_place, demand, "large");
    write(folder, bytes);
    EXPECT_FALSE(watcher.poll());
    const auto polled = watcher.poll();
    ASSERT_TRUE(polled);
    EXPECT_FALSE(is_whole(*polled));
    EXPECT_FALSE(*watcher.complete());
    EXPECT_TRUE(use->want(polled->find("large").get()));
    const auto all = watcher.complete().value();
    ASSERT_TRUE(all);
    EXPECT_TRUE(is_whole(*all));
    EXPECT_EQ(all->find("large")->description(), polled->find("large")->description());
    EXPECT_FALSE(watcher.poll());
    use.reset();
    EXPECT_TRUE(watcher.drop_unused({}));
  }
}

TEST_F(OnDemand, WhatCannotBeReadIsRefusedAndTheCoarseScalesStay) {
  std::vector<std::byte> bytes = large();
  testing::damage_page(bytes, testing::page_count(bytes) - 1);
  const auto file = write(folder, bytes);
  for (const auto& input : {file, file.parent_path()}) {
    ScaleDemand here;
    CatalogueWatcher watcher({input}, memory, false, &here);
    const auto coarse = watcher.load().value();
    ScaleDemand::Use use(here, "large");
    EXPECT_TRUE(use.want(coarse.find("large").get()));
    const auto failed = watcher.complete();
    ASSERT_TRUE(failed && *failed);
    EXPECT_EQ((*failed)->find("large"), coarse.find("large"));
    EXPECT_FALSE(*watcher.complete()) << "it is not tried again at once";
    EXPECT_FALSE(use.want(coarse.find("large").get()));
    EXPECT_FALSE(watcher.poll());
    EXPECT_FALSE(watcher.poll());
  }
}

// What is wanted is told from the session's thread to the one that reads.
TEST_F(OnDemand, ASessionGetsTheScalesThatItWants) {
  const auto file = write(folder, large());
  ServeOptions options;
  options.on_demand = true;
  const auto server = start(options);
  ASSERT_TRUE(server->scale_demand());
  EXPECT_FALSE(start()->scale_demand());
  CatalogueWatcher watcher({file}, server->memory(), false, server->scale_demand());
  auto coarse = watcher.load().value();
  const std::uint64_t some = coarse.find("large")->size(), all = coarse.find("large")->description().updates;
  server->offer(std::move(coarse));
  std::optional<RawClient> client(server->port());
  client->send(protocol::Open{"large", "test", protocol::kMaxWindow});
  protocol::View view{1, {.error_percent = 100}};
  view.shown = {{{-1, 2}}, Refine::uniform};
  client->send(view);
  EXPECT_EQ(client->expect<protocol::Opened>().description.updates, all);
  EXPECT_EQ(client->stream_to_end(), 0U) << "done without more";
  EXPECT_FALSE(*watcher.complete());
  view.epoch = 2;
  view.lod = {};
  view.early = true;
  client->send(view);
  std::uint64_t updates = 0;
  while (updates < some) updates += client->expect<protocol::Batch>().updates;
  EXPECT_EQ(updates, some);
  std::optional<Catalogue> whole;
  ASSERT_TRUE(eventually([&] {
    whole = watcher.complete().value();
    return whole.has_value();
  }));
  EXPECT_TRUE(is_whole(*whole));
  server->offer(std::move(*whole));
  EXPECT_EQ(updates + client->stream_to_end(), all);
  EXPECT_FALSE(watcher.drop_unused({}));
  client.reset();
  EXPECT_TRUE(eventually([&] { return watcher.drop_unused({}).has_value(); }));
}

TEST_F(OnDemand, ASessionEndsWhereTheRestIsDamaged) {
  std::vector<std::byte> damaged = large();
  testing::damage_page(damaged, testing::page_count(damaged) - 1);
  ServeOptions options;
  options.on_demand = true;
  const auto server = start(options);
  CatalogueWatcher watcher({write(folder, damaged)}, server->memory(), false, server->scale_demand());
  server->offer(watcher.load().value());
  for (int i = 0; i < 2; ++i) {
    RawClient client(server->port());
    client.send(protocol::Open{"large", "test", protocol::kMaxWindow});
    client.send(protocol::View{1, {}});
    EXPECT_TRUE(client.expect<protocol::Opened>().description.updates > 0);
    if (i == 0) {
      std::optional<Catalogue> tried;
      ASSERT_TRUE(eventually([&] {
        tried = watcher.complete().value();
        return tried.has_value();
      }));
      server->offer(std::move(*tried));
    }
    const auto end = client.end();
    EXPECT_EQ(end.code, unsigned(CloseCode::going_away));
    ASSERT_TRUE(end.fault);
    EXPECT_EQ(end.fault->text, "the rest of the data set could not be read");
  }
}

// A server that has started again has the coarse scales only, and reads those that its clients have.
TEST_F(OnDemand, WhoResumesWaitsForTheScalesThatItHas) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const auto file = write(folder, large());
  auto server = start();
  const std::uint16_t port = server->port();
  {
    CatalogueWatcher watcher({file}, server->memory());
    ASSERT_TRUE(watcher.load());
    server->offer(*watcher.complete().value());
  }
  MeshRequest request;
  request.shown.ranges = {{0.4, 0.6}};
  auto live = LiveMesh::connect("ws://127.0.0.1:" + std::to_string(port) + "/large", request, {.reconnect = std::chrono::seconds(1)});
  ASSERT_TRUE(live) << live.error().message;
  std::uint64_t bytes = 0;
  const auto is_done = [&live, &bytes] {
    const auto state = live->wait(std::chrono::milliseconds(100));
    if (!state) throw std::runtime_error(state.error().message);
    if (*state) bytes = (*state)->bytes;
    return *state && (*state)->is_done;
  };
  ASSERT_TRUE(eventually(is_done));
  const std::uint64_t before = bytes;
  server.reset();
  ServeOptions options;
  options.on_demand = true;
  options.listen = "127.0.0.1:" + std::to_string(port);
  server = Server::start(options).value();
  CatalogueWatcher watcher({file}, server->memory(), false, server->scale_demand());
  server->offer(watcher.load().value());
  request.shown.ranges = {{0.4, 0.6001}};
  ASSERT_TRUE(live->look(request));
  std::this_thread::sleep_for(std::chrono::seconds(3));  // longer than it would try to reconnect
  ASSERT_TRUE(eventually([&] {
    auto more = watcher.complete().value();
    const bool is_last = more && is_whole(*more);
    if (more) server->offer(std::move(*more));
    return is_last;
  }));
  ASSERT_TRUE(eventually(is_done));
  EXPECT_LT(bytes - before, before / 4) << "the rest only";
}

TEST_F(OnDemand, TheProgramReadsOnAndDrops) {
  write(folder, large());
  ServerProgram server(folder.path(), {"--on-demand", "--keep-time", "0.1"}), plain(folder.path());
  const std::string memory_of = "intervale_dataset_memory_bytes{dataset=\"large\"}";
  const double coarse = metric(server.port(), memory_of);
  const auto fetch = [](const ServerProgram& from, const Arguments& more) {
    const auto fetched = run(Arguments{program("intervale-client"), "fetch", from.url("large"), "--range", "0.4", "0.6", "--digest"} + more);
    EXPECT_EQ(fetched.status, 0) << fetched.err;
    return fetched.out;
  };
  fetch(server, {"--error-percent", "100"});
  EXPECT_EQ(metric(server.port(), memory_of), coarse);
  EXPECT_EQ(fetch(server, {}).substr(0, 60), fetch(plain, {}).substr(0, 60));
  EXPECT_TRUE(server.process().wait_for("all scales are loaded"));
  EXPECT_TRUE(server.process().wait_for("finer scales are dropped"));
  EXPECT_TRUE(eventually([&] { return metric(server.port(), memory_of) == coarse; }));
  EXPECT_EQ(fetch(server, {}).substr(0, 60), fetch(plain, {}).substr(0, 60)) << "they are read again";
}

TEST_F(OnDemand, AWebServerThatDoesNotAnswerHoldsUpNoFile) {
  const auto file = write(folder, large());
  testing::FileServer web(contents_of(file));
  ServerProgram server(folder.path(), {web.url("/far.ivm"), "--on-demand"});
  web.misbehave([](const testing::FileRequest&, std::size_t, testing::FileAnswer& answer) { answer.hangs = true; });
  const std::size_t before = web.requests().size();
  Process waits({program("intervale-client"), "fetch", server.url("far"), "--range", "0.4", "0.6"});
  ASSERT_TRUE(eventually([&] { return web.requests().size() > before; }));
  const auto begun = std::chrono::steady_clock::now();
  const auto fetched = run({program("intervale-client"), "fetch", server.url("large"), "--range", "0.4", "0.6"});
  EXPECT_EQ(fetched.status, 0) << fetched.err;
  std::filesystem::copy_file(buckyball(), folder / "new.ivm");
  EXPECT_TRUE(server.process().wait_for("new.ivm was loaded"));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(20)) << "less than what is waited for a web server";
  EXPECT_EQ(web.requests().size(), before + 1) << "which is what it still does";
  waits.signal(SIGTERM);
}

// A server that is reached again and again, but has nothing new, is lost.
TEST_F(OnDemand, AFetchEndsWhereTheRestIsDamaged) {
  std::vector<std::byte> damaged = large();
  testing::damage_page(damaged, testing::page_count(damaged) - 1);
  const ServerProgram server(write(folder, damaged).string(), {"--on-demand"});
  const auto begun = std::chrono::steady_clock::now();
  const auto fetched = run({program("intervale-client"), "fetch", server.url("large"), "--range", "0.4", "0.6", "--reconnect", "2"});
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(20));
  EXPECT_EQ(fetched.status, 1);
  EXPECT_THAT(fetched.err, HasSubstr("intervale-client: the server at 127.0.0.1"));
  EXPECT_THAT(fetched.err, HasSubstr("the rest of the data set could not be read"));
}

TEST(OnDemandOptions, ThatCannotBeAreOneLine) {
  const auto serve = [](const Arguments& more) { return run(Arguments{program("intervale"), "serve", buckyball().string()} + more); };
  for (const Arguments& wrong : {Arguments{"--keep-time", "5"}, Arguments{"--on-demand", "--tolerate-damage"},
                                 Arguments{"--on-demand", "--max-memory", "1GB"}, Arguments{"--on-demand", "--keep-time", "-1"}}) {
    const auto refused = serve(wrong);
    EXPECT_EQ(refused.status, 2);
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  }
}

}  // namespace
}  // namespace intervale::large_files
