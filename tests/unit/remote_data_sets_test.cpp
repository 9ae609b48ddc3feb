#include "server/serve/remote_data_sets.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/parallel/all_cores.h"
#include "server/builder/value_builder.h"
#include "server/serve/catalogue_watcher.h"
#include "tests/support/file_server.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using testing::FileAnswer, testing::FileRequest, testing::FileServer;

// One scale can be had before all of it.
const std::string& large() {
  static const std::string file = [] {
    auto field = testing::random_value_field({134, 70, 66}, 1);
    const auto bytes = encode_values(build_value_volume(field.volume, field.format), on_all_cores);
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }();
  return file;
}

struct RemoteDataSetsTest : ::testing::Test {
  RemoteDataSetsTest() { spdlog::set_level(spdlog::level::off); }
  ~RemoteDataSetsTest() override { spdlog::set_level(spdlog::level::info); }
  [[nodiscard]] RemoteInputs inputs() const {
    RemoteInputs inputs{.urls = {parse_remote_url(web.url()).value()}, .access = {}, .poll_time = std::chrono::milliseconds(0)};
    inputs.limits.attempts = 1;
    return inputs;
  }
  static std::shared_ptr<const IntervalVolume> scan(const Catalogue& catalogue) { return catalogue.find("scan"); }
  FileServer web{large()};
  Memory memory;
};

TEST_F(RemoteDataSetsTest, AreServedByTheirCoarseScalesFirst) {
  CatalogueWatcher watcher({}, memory, false, inputs());
  const auto coarse = scan(watcher.load().value());
  ASSERT_TRUE(coarse);
  EXPECT_FALSE(coarse->is_whole());
  const std::size_t before = web.requests().size();
  const auto more = watcher.complete();
  ASSERT_TRUE(more && *more);
  EXPECT_GT(web.requests().size(), before);
  const auto whole = scan(**more);
  EXPECT_TRUE(whole->is_whole());
  EXPECT_EQ(whole->description(), coarse->description());
  EXPECT_EQ(whole->size(), decode_volume(std::as_bytes(std::span(large())), "scan", on_all_cores)->size());
  EXPECT_FALSE(*watcher.complete());
  EXPECT_FALSE(watcher.poll()) << "it has not changed";
}

TEST_F(RemoteDataSetsTest, WhatCannotBeReadOnStaysCoarseUntilItCan) {
  CatalogueWatcher watcher({}, memory, false, inputs());
  ASSERT_FALSE(scan(watcher.load().value())->is_whole());
  std::atomic<bool> is_away = true;
  web.misbehave([&](const FileRequest&, std::size_t, FileAnswer& answer) {
    if (is_away) answer = {.status = 404};
  });
  const auto more = watcher.complete();
  ASSERT_TRUE(more && *more);
  EXPECT_FALSE(scan(**more)->is_whole());
  EXPECT_FALSE(*watcher.complete()) << "it is not tried again at once";
  EXPECT_FALSE(watcher.poll());
  is_away = false;
  const auto mended = watcher.poll();
  ASSERT_TRUE(mended);
  EXPECT_TRUE(scan(*mended)->is_whole());
  EXPECT_FALSE(watcher.poll());
}

TEST_F(RemoteDataSetsTest, AnotherFileTakesThePlaceOfTheOneThatWasBegun) {
  CatalogueWatcher watcher({}, memory, false, inputs());
  const auto before = scan(watcher.load().value());
  auto field = testing::random_value_field({9, 8, 7}, 2);
  const auto bytes = encode_values(build_value_volume(field.volume, field.format));
  web.set(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), "\"two\"");
  const auto more = watcher.complete();
  ASSERT_TRUE(more && *more);
  EXPECT_TRUE(scan(**more)->is_whole());
  EXPECT_NE(scan(**more)->description(), before->description());
  EXPECT_FALSE(*watcher.complete());
}

TEST_F(RemoteDataSetsTest, OnDemandScalesAreReadOnceTheyAreWantedAndDroppedAgain) {
  ScaleDemand demand;
  CatalogueWatcher watcher({}, memory, false, inputs(), &demand);
  const auto coarse = scan(watcher.load().value());
  std::size_t before = web.requests().size();
  EXPECT_FALSE(*watcher.complete());
  EXPECT_EQ(web.requests().size(), before);
  EXPECT_FALSE(watcher.poll()) << "it has not changed";
  for (int i = 0; i < 2; ++i) {
    auto use = demand.use("scan");
    std::shared_ptr<const IntervalVolume> held = coarse;
    while (!held->is_whole()) {
      EXPECT_TRUE(demand.ask("scan", held->size()));
      const auto more = watcher.complete();
      ASSERT_TRUE(more && *more);
      held = scan(**more);
    }
    EXPECT_EQ(held->description(), coarse->description());
    EXPECT_FALSE(watcher.drop_unused({}));
    use.reset();
    const auto fewer = watcher.drop_unused({});
    ASSERT_TRUE(fewer);
    EXPECT_EQ(scan(*fewer), coarse);
    EXPECT_FALSE(watcher.drop_unused({}));
  }
}

TEST_F(RemoteDataSetsTest, OnDemandWhatCannotBeReadIsRefusedUntilItCan) {
  ScaleDemand demand;
  CatalogueWatcher watcher({}, memory, false, inputs(), &demand);
  const auto coarse = scan(watcher.load().value());
  std::atomic<bool> is_away = true;
  web.misbehave([&](const FileRequest&, std::size_t, FileAnswer& answer) {
    if (is_away) answer = {.status = 404};
  });
  const auto use = demand.use("scan");
  EXPECT_TRUE(demand.ask("scan", coarse->size()));
  const auto failed = watcher.complete();
  ASSERT_TRUE(failed && *failed);
  EXPECT_EQ(scan(**failed), coarse);
  EXPECT_FALSE(*watcher.complete()) << "it is not tried again at once";
  EXPECT_FALSE(demand.ask("scan", coarse->size()));
  is_away = false;
  EXPECT_FALSE(watcher.poll());
  const auto later = ScaleDemand::Clock::now() + ScaleDemand::kRetry;
  std::shared_ptr<const IntervalVolume> held = coarse;
  while (!held->is_whole()) {
    EXPECT_TRUE(demand.ask("scan", held->size(), later));
    const auto more = watcher.complete();
    ASSERT_TRUE(more && *more);
    held = scan(**more);
  }
}

TEST_F(RemoteDataSetsTest, OnDemandAFileThatChangesIsDroppedToItsOwnCoarseScales) {
  ScaleDemand demand;
  CatalogueWatcher watcher({}, memory, false, inputs(), &demand);
  const auto before = scan(watcher.load().value());
  auto field = testing::random_value_field({134, 70, 66}, 2);
  const auto bytes = encode_values(build_value_volume(field.volume, field.format), on_all_cores);
  web.set(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), "\"two\"");
  const auto changed = watcher.poll();
  ASSERT_TRUE(changed);
  const auto whole = scan(*changed);
  EXPECT_NE(whole->description(), before->description());
  const auto fewer = watcher.drop_unused({});
  ASSERT_TRUE(fewer);
  EXPECT_EQ(scan(*fewer)->description(), whole->description());
  EXPECT_LT(scan(*fewer)->size(), whole->size());
}

TEST_F(RemoteDataSetsTest, AreReadWholeAtOnceWhereMemoryIsLimited) {
  Memory limited(std::uint64_t(1) << 30);
  CatalogueWatcher watcher({}, limited, false, inputs());
  EXPECT_TRUE(scan(watcher.load().value())->is_whole());
  EXPECT_FALSE(*watcher.complete());
}

}  // namespace
}  // namespace intervale
