#include "server/serve/remote_data_sets.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/parallel/all_cores.h"
#include "server/builder/value_builder.h"
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
  RemoteDataSets sets(inputs(), memory);
  const auto coarse = scan(sets.load().value());
  ASSERT_TRUE(coarse);
  EXPECT_FALSE(coarse->is_whole());
  const std::size_t before = web.requests().size();
  const auto more = sets.complete();
  ASSERT_TRUE(more && *more);
  EXPECT_GT(web.requests().size(), before);
  const auto whole = scan(**more);
  EXPECT_TRUE(whole->is_whole());
  EXPECT_EQ(whole->description(), coarse->description());
  EXPECT_EQ(whole->size(), decode_volume(std::as_bytes(std::span(large())), "scan", on_all_cores)->size());
  EXPECT_FALSE(*sets.complete());
  EXPECT_FALSE(sets.poll()) << "it has not changed";
}

TEST_F(RemoteDataSetsTest, WhatCannotBeReadOnStaysCoarseUntilItCan) {
  RemoteDataSets sets(inputs(), memory);
  ASSERT_FALSE(scan(sets.load().value())->is_whole());
  std::atomic<bool> is_away = true;
  web.misbehave([&](const FileRequest&, std::size_t, FileAnswer& answer) {
    if (is_away) answer = {.status = 404};
  });
  const auto more = sets.complete();
  ASSERT_TRUE(more && *more);
  EXPECT_FALSE(scan(**more)->is_whole());
  EXPECT_FALSE(*sets.complete()) << "it is not tried again at once";
  EXPECT_FALSE(sets.poll());
  is_away = false;
  const auto mended = sets.poll();
  ASSERT_TRUE(mended);
  EXPECT_TRUE(scan(*mended)->is_whole());
  EXPECT_FALSE(sets.poll());
}

TEST_F(RemoteDataSetsTest, AnotherFileTakesThePlaceOfTheOneThatWasBegun) {
  RemoteDataSets sets(inputs(), memory);
  const auto before = scan(sets.load().value());
  auto field = testing::random_value_field({9, 8, 7}, 2);
  const auto bytes = encode_values(build_value_volume(field.volume, field.format));
  web.set(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), "\"two\"");
  const auto more = sets.complete();
  ASSERT_TRUE(more && *more);
  EXPECT_TRUE(scan(**more)->is_whole());
  EXPECT_NE(scan(**more)->description(), before->description());
  EXPECT_FALSE(*sets.complete());
}

TEST_F(RemoteDataSetsTest, OnDemandScalesAreReadOnceTheyAreWantedAndDroppedAgain) {
  ScaleDemand demand;
  RemoteDataSets sets(inputs(), memory, false, &demand);
  const auto coarse = scan(sets.load().value());
  std::size_t before = web.requests().size();
  EXPECT_FALSE(*sets.complete());
  EXPECT_EQ(web.requests().size(), before);
  EXPECT_FALSE(sets.poll()) << "it has not changed";
  for (int i = 0; i < 2; ++i) {
    std::optional<ScaleDemand::Use> use(std::in_place, demand, "scan");
    std::shared_ptr<const IntervalVolume> held = coarse;
    while (!held->is_whole()) {
      EXPECT_TRUE(use->want(held.get()));
      const auto more = sets.complete();
      ASSERT_TRUE(more && *more);
      held = scan(**more);
    }
    EXPECT_EQ(held->description(), coarse->description());
    EXPECT_FALSE(sets.drop_unused({}));
    use.reset();
    const auto fewer = sets.drop_unused({});
    ASSERT_TRUE(fewer);
    EXPECT_EQ(scan(*fewer), coarse);
    EXPECT_FALSE(sets.drop_unused({}));
  }
}

TEST_F(RemoteDataSetsTest, OnDemandWhatCannotBeReadIsRefusedUntilItCan) {
  ScaleDemand demand;
  RemoteDataSets sets(inputs(), memory, false, &demand);
  const auto coarse = scan(sets.load().value());
  std::atomic<bool> is_away = true;
  web.misbehave([&](const FileRequest&, std::size_t, FileAnswer& answer) {
    if (is_away) answer = {.status = 404};
  });
  ScaleDemand::Use use(demand, "scan");
  EXPECT_TRUE(use.want(coarse.get()));
  const auto failed = sets.complete();
  ASSERT_TRUE(failed && *failed);
  EXPECT_EQ(scan(**failed), coarse);
  EXPECT_FALSE(*sets.complete()) << "it is not tried again at once";
  EXPECT_FALSE(use.want(coarse.get()));
  is_away = false;
  EXPECT_FALSE(sets.poll());
  const auto later = ScaleDemand::Clock::now() + ScaleDemand::kRetry;
  std::shared_ptr<const IntervalVolume> held = coarse;
  while (!held->is_whole()) {
    EXPECT_TRUE(use.want(held.get(), later));
    const auto more = sets.complete();
    ASSERT_TRUE(more && *more);
    held = scan(**more);
  }
}

TEST_F(RemoteDataSetsTest, OnDemandAFileThatChangesIsServedByItsOwnCoarseScales) {
  ScaleDemand demand;
  RemoteDataSets sets(inputs(), memory, false, &demand);
  const auto before = scan(sets.load().value());
  EXPECT_FALSE(sets.poll());
  auto field = testing::random_value_field({134, 70, 66}, 2);
  const auto bytes = encode_values(build_value_volume(field.volume, field.format), on_all_cores);
  web.set(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), "\"two\"");
  const auto changed = sets.poll();
  ASSERT_TRUE(changed);
  std::shared_ptr<const IntervalVolume> held = scan(*changed);
  EXPECT_NE(held->description(), before->description());
  EXPECT_FALSE(held->is_whole());
  EXPECT_FALSE(sets.poll());
  ScaleDemand::Use use(demand, "scan");
  while (!held->is_whole()) {
    EXPECT_TRUE(use.want(held.get()));
    const auto more = sets.complete();
    ASSERT_TRUE(more && *more);
    held = scan(**more);
  }
  EXPECT_NE(held->description(), before->description());
}

TEST_F(RemoteDataSetsTest, AreReadWholeAtOnceWhereMemoryIsLimited) {
  Memory limited(std::uint64_t(1) << 30);
  RemoteDataSets sets(inputs(), limited);
  EXPECT_TRUE(scan(sets.load().value())->is_whole());
  EXPECT_FALSE(*sets.complete());
}

}  // namespace
}  // namespace intervale
