// Large files of every range are served by their coarse scales at first.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <array>
#include <cmath>
#include <random>

#include "common/ivm/value_file.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "server/serve/catalogue_watcher.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/page_damage.h"
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
  const std::uint64_t hash = coarse.find("large")->description().content_hash;
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
  RawClient other(server->port());
  other.send(protocol::Open{"large", "test", protocol::kMinCredit, hash});
  EXPECT_EQ(other.end().code, unsigned(CloseCode::going_away)) << "it may have updates that are not there yet";
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

}  // namespace
}  // namespace intervale::large_files
