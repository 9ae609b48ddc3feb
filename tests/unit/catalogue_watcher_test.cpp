#include "server/serve/catalogue_watcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <fstream>
#include <stop_token>
#include <string>
#include <vector>

#include "common/ivm/ivm_file.h"
#include "common/parallel/all_cores.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

void save(const std::filesystem::path& path, double low) {
  const auto volume = FieldHierarchy(testing::gyroid({9, 7, 6}), {.range = {low, 0.4}}).compact();
  ASSERT_TRUE(save_ivm(path, volume.value(), [](std::size_t count, const auto& body) {
    for (std::size_t i = 0; i < count; ++i) body(i);
  }));
}

std::vector<std::string> names(const Catalogue& catalogue) {
  std::vector<std::string> names;
  for (const auto& [name, volume] : catalogue.volumes()) names.push_back(name);
  return names;
}

struct Watched : ::testing::Test {
  Watched() { spdlog::set_level(spdlog::level::off); }
  ~Watched() override { spdlog::set_level(spdlog::level::info); }
  TempDir folder;
  Memory memory;
  CatalogueWatcher watcher{{folder.path()}, memory};
};

using CatalogueWatcherTest = Watched;

TEST_F(CatalogueWatcherTest, LoadsANewFileOnceItIsStable) {
  save(folder / "a.ivm", -0.3);
  EXPECT_THAT(names(watcher.load().value()), ElementsAre("a"));
  EXPECT_FALSE(watcher.poll());
  save(folder / "b.ivm", -0.3);
  folder.file("c.txt", "no data set");
  EXPECT_FALSE(watcher.poll()) << "it may be under way";
  const auto both = watcher.poll();
  ASSERT_TRUE(both);
  EXPECT_THAT(names(*both), ElementsAre("a", "b"));
  EXPECT_FALSE(watcher.poll());
}

TEST_F(CatalogueWatcherTest, DoesNotReadAFileThatIsBeingWritten) {
  save(folder / "whole.tmp", -0.3);
  const std::string bytes = contents_of(folder / "whole.tmp");
  EXPECT_THAT(names(watcher.load().value()), IsEmpty());
  for (std::size_t size = 1; size < 20; ++size) {
    folder.file("a.ivm", bytes.substr(0, size));
    EXPECT_FALSE(watcher.poll());
  }
  folder.file("a.ivm", bytes);
  EXPECT_FALSE(watcher.poll());
  EXPECT_TRUE(watcher.poll());
}

TEST_F(CatalogueWatcherTest, AChangedFileIsReloadedAndUsersOfTheOldContentsKeepThem) {
  save(folder / "a.ivm", -0.3);
  const auto before = watcher.load().value().find("a");
  save(folder / "a.ivm", -0.2);
  (void)watcher.poll();
  const auto changed = watcher.poll();
  ASSERT_TRUE(changed);
  const auto after = changed->find("a");
  EXPECT_NE(after->description().content_hash, before->description().content_hash);
  EXPECT_EQ(before->description().range.alpha, -0.3);
  // The same again, with another time: nobody needs to know.
  save(folder / "a.ivm", -0.2);
  EXPECT_FALSE(watcher.poll());
  EXPECT_FALSE(watcher.poll());
}

TEST_F(CatalogueWatcherTest, ARemovedFileLeavesTheCatalogue) {
  save(folder / "a.ivm", -0.3);
  save(folder / "b.ivm", -0.3);
  const Catalogue before = watcher.load().value();
  std::filesystem::remove(folder / "a.ivm");
  const auto after = watcher.poll();
  ASSERT_TRUE(after);
  EXPECT_THAT(names(*after), ElementsAre("b"));
  EXPECT_NE(before.find("a"), nullptr);
}

TEST_F(CatalogueWatcherTest, DamageToAFileDoesNotAffectSessions) {
  save(folder / "a.ivm", -0.3);
  const std::string bytes = contents_of(folder / "a.ivm");
  const auto volume = watcher.load().value().find("a");
  std::string flipped = bytes;
  flipped[bytes.size() / 2] ^= 1;
  for (const std::string& damaged : {std::string(), bytes.substr(0, bytes.size() / 2), flipped, bytes + "x", std::string(1000, '\xff')}) {
    folder.file("a.ivm", damaged);
    EXPECT_FALSE(watcher.poll());
    EXPECT_FALSE(watcher.poll());
    EXPECT_EQ(watcher.poll(), std::nullopt);
  }
  folder.file("b.ivm", "damaged");
  (void)watcher.poll();
  EXPECT_FALSE(watcher.poll()) << "and b is not there";
  save(folder / "b.ivm", -0.2);
  (void)watcher.poll();
  const auto mended = watcher.poll();
  ASSERT_TRUE(mended);
  EXPECT_THAT(names(*mended), ElementsAre("a", "b"));
  EXPECT_EQ(mended->find("a"), volume);
}

// As one is that may be read only later, or that a copy puts in its place which keeps its time.
TEST_F(CatalogueWatcherTest, AChangedFileIsReadWhateverItsModificationTime) {
  save(folder / "a.ivm", -0.3);
  const std::string good = contents_of(folder / "a.ivm");
  const auto time = std::filesystem::last_write_time(folder / "a.ivm");
  const auto write_in_place = [&](const std::string& bytes) {
    const auto before = stamp_of(folder / "a.ivm");
    do {  // until the clock of the file system has gone on
      std::ofstream(folder / "a.ivm", std::ios::binary | std::ios::in) << bytes;
      std::filesystem::last_write_time(folder / "a.ivm", time);
    } while (stamp_of(folder / "a.ivm") == before);
  };
  write_in_place(std::string(good.size(), 'x'));
  EXPECT_THAT(names(watcher.load().value()), IsEmpty());
  write_in_place(good);
  EXPECT_FALSE(watcher.poll());
  const auto mended = watcher.poll();
  ASSERT_TRUE(mended);
  EXPECT_THAT(names(*mended), ElementsAre("a"));
}

TEST_F(CatalogueWatcherTest, AMissingFolderKeepsItsDataSets) {
  std::filesystem::create_directory(folder / "in");
  save(folder / "in/a.ivm", -0.3);
  for (const char* name : {"in", "in/", "./in//"}) {
    CatalogueWatcher watch_in({folder / name}, memory);
    ASSERT_TRUE(watch_in.load());
    std::filesystem::rename(folder / "in", folder / "out");
    EXPECT_FALSE(watch_in.poll()) << name;
    std::filesystem::rename(folder / "out", folder / "in");
    EXPECT_FALSE(watch_in.poll()) << name;
    std::filesystem::rename(folder / "in/a.ivm", folder / "a.ivm");
    EXPECT_TRUE(watch_in.poll()) << name;
    std::filesystem::rename(folder / "a.ivm", folder / "in/a.ivm");
  }
}

TEST_F(CatalogueWatcherTest, AFileWithAnInvalidNameIsSkipped) {
  save(folder / "a.ivm", -0.3);
  for (const char* name : {"a?.ivm", "b\n.ivm", "c\xff.ivm", "d\xc2\x9b.ivm"}) std::filesystem::copy_file(folder / "a.ivm", folder / name);
  EXPECT_THAT(names(watcher.load().value()), ElementsAre("a"));
  EXPECT_FALSE(watcher.poll());
  EXPECT_FALSE(CatalogueWatcher({folder / "a?.ivm"}, memory).load()) << "one that is named is an error";
}

TEST_F(CatalogueWatcherTest, OfTwoDataSetsOfOneNameTheFirstCounts) {
  std::filesystem::create_directory(folder / "x");
  std::filesystem::create_directory(folder / "y");
  save(folder / "y/a.ivm", -0.3);
  CatalogueWatcher both({folder / "x", folder / "y"}, memory);
  const auto first = both.load().value().find("a");
  save(folder / "x/a.ivm", -0.2);
  (void)both.poll();
  const auto changed = both.poll();
  ASSERT_TRUE(changed);
  EXPECT_NE(changed->find("a"), first);
  EXPECT_THAT(names(*changed), ElementsAre("a"));
  const auto again = CatalogueWatcher({folder / "x", folder / "y"}, memory).load();
  ASSERT_TRUE(again) << "so it is if the server starts again";
  EXPECT_EQ(again->find("a")->description(), changed->find("a")->description());
  EXPECT_NE(again->find("a")->description(), first->description());
  const auto named = CatalogueWatcher({folder / "x/a.ivm", folder / "y/a.ivm"}, memory).load();
  ASSERT_FALSE(named) << "of two that are named it is an error";
  EXPECT_THAT(named.error().message, HasSubstr("two data sets are named 'a'"));
}

TEST_F(CatalogueWatcherTest, ReadsNothingAboveTheMemoryLimit) {
  Memory none(0);
  const Memory::Share held(none, Memory::Holder::sessions, 1);
  CatalogueWatcher poor({folder.path()}, none);
  save(folder / "a.ivm", -0.3);
  EXPECT_THAT(names(poor.load().value()), IsEmpty());
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(poor.poll());
}

TEST_F(CatalogueWatcherTest, AFileThatTakesMoreThanIsLeftIsReadOnceThereIsRoom) {
  save(folder / "a.ivm", -0.3);
  Memory some(std::uint64_t(1) << 20);
  Memory::Share others(some, Memory::Holder::sessions, (std::uint64_t(1) << 20) - 2000);
  CatalogueWatcher patient({folder.path()}, some);
  EXPECT_THAT(names(patient.load().value()), IsEmpty());
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(patient.poll());
  others.resize(0);
  const auto all = patient.poll();
  ASSERT_TRUE(all);
  EXPECT_THAT(names(*all), ElementsAre("a"));
  EXPECT_EQ(some.bytes(), all->find("a")->memory_bytes());
}

TEST_F(CatalogueWatcherTest, ReadsNothingMoreOnceItIsStopped) {
  save(folder / "a.ivm", -0.3);
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_THROW((void)watcher.load(on_all_cores_until(stopped.get_token())), Stopped);
  EXPECT_FALSE(watcher.poll());
  EXPECT_THROW((void)watcher.poll(on_all_cores_until(stopped.get_token())), Stopped);
  EXPECT_TRUE(watcher.poll()) << "nothing was lost";
}

}  // namespace
}  // namespace intervale
