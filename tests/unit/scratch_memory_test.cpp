#include "server/scratch/scratch_memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

constexpr std::uint64_t kBudget = std::uint64_t(1) << 30;
#if defined(__SANITIZE_THREAD__)
constexpr bool kAreSignalsPrompt = false;  // the sanitizer holds them back
#else
constexpr bool kAreSignalsPrompt = true;
#endif

std::unique_ptr<ScratchMemory> open_scratch(const TempDir& folder) {
  auto memory = ScratchMemory::open(folder.path(), kBudget, 1);
  EXPECT_TRUE(memory) << memory.error().message;
  return std::move(*memory);
}

// An array, and what it was filled with.
struct Filled {
  std::byte* at;
  std::size_t bytes;
  std::byte value;
};

bool is_kept(const Filled& array) {
  return std::all_of(array.at, array.at + array.bytes, [&](std::byte b) { return b == array.value; });
}

TEST(ScratchMemory, ArraysDoNotOverlapAndKeepWhatIsInThem) {
  const TempDir folder;
  const auto memory = open_scratch(folder);
  std::mt19937 random(20);
  std::vector<Filled> arrays;
  std::size_t held = 0, most = 0;
  for (int step = 0; step < 300; ++step) {
    if (arrays.size() > 8 || (!arrays.empty() && random() % 3 == 0)) {
      std::swap(arrays[random() % arrays.size()], arrays.back());
      EXPECT_TRUE(is_kept(arrays.back()));
      memory->free(arrays.back().at);
      held -= arrays.back().bytes;
      arrays.pop_back();
      continue;
    }
    const std::size_t bytes = random() % 8 == 0 ? (16 << 20) + random() % 1000 : 1 + random() % 300'000;
    const Filled array{static_cast<std::byte*>(memory->allocate(bytes)), bytes, std::byte(random())};
    EXPECT_TRUE(memory->owns(array.at));
    std::fill_n(array.at, bytes, array.value);
    arrays.push_back(array);
    held += bytes;
    most = std::max(most, held);
  }
  for (const Filled& array : arrays) EXPECT_TRUE(is_kept(array));
  EXPECT_GE(memory->most_bytes(), most);
  for (const Filled& array : arrays) memory->free(array.at);
}

TEST(ScratchMemory, SmallArraysLieSideBySideAndTheirPlaceIsUsedAgain) {
  const TempDir folder;
  const auto memory = open_scratch(folder);
  std::mt19937 random(20);
  std::vector<Filled> arrays;
  for (int step = 0; step < 20'000; ++step) {
    if (arrays.size() > 3000 || (!arrays.empty() && random() % 3 == 0)) {
      std::swap(arrays[random() % arrays.size()], arrays.back());
      EXPECT_TRUE(is_kept(arrays.back()));
      memory->free(arrays.back().at);
      arrays.pop_back();
      continue;
    }
    const std::size_t bytes = 1 + random() % (random() % 4 == 0 ? 8000 : 300);
    arrays.push_back({static_cast<std::byte*>(memory->allocate(bytes)), bytes, std::byte(random())});
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(arrays.back().at) % alignof(std::max_align_t), 0u);
    std::fill_n(arrays.back().at, bytes, arrays.back().value);
  }
  std::size_t held = 0;
  for (const Filled& array : arrays) {
    EXPECT_TRUE(is_kept(array));
    held += std::max(array.bytes, SmallArrays::kLeastBytes);
  }
  EXPECT_LE(memory->array_bytes(), 2 * held + SmallArrays::kSizeClasses * SmallArrays::kChunkBytes);
  for (const Filled& array : arrays) memory->free(array.at);
  EXPECT_LE(memory->array_bytes(), SmallArrays::kSizeClasses * SmallArrays::kChunkBytes) << "a chunk of each size stays";
}

// One hole that everything is given back to, whatever the order.
TEST(ScratchMemory, WhatIsFreedIsUsedAgain) {
  const TempDir folder;
  const auto memory = open_scratch(folder);
  std::vector<void*> arrays;
  arrays.reserve(16);
  for (int i = 0; i < 16; ++i) arrays.push_back(memory->allocate(1 << 20));
  const std::uint64_t all = memory->most_bytes();
  std::shuffle(arrays.begin(), arrays.end(), std::mt19937(20));
  for (void* const array : arrays) memory->free(array);
  void* const whole = memory->allocate(16 << 20);
  EXPECT_EQ(memory->most_bytes(), all);
  memory->free(whole);
}

TEST(ScratchMemory, LeavesNothingInTheFolder) {
  const TempDir folder;
  {
    const auto memory = open_scratch(folder);
    memory->free(memory->allocate(1 << 20));
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(ScratchMemory, TellsWhyItCannotBe) {
  const TempDir folder;
  const auto small = ScratchMemory::open(folder.path(), 1 << 20, 3);
  ASSERT_FALSE(small);
  EXPECT_THAT(small.error().message, ::testing::HasSubstr("at least 168 MB"));
  const auto nowhere = ScratchMemory::open(folder / "none", kBudget, 1);
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error().message, ::testing::HasSubstr("No such file or directory"));
}

// On a disk, wherever temporary files are.
std::unique_ptr<ScratchMemory> open_for_data(std::uint64_t budget) {
  auto memory = ScratchMemory::open_for_data_sets("/var/tmp", budget);
  EXPECT_TRUE(memory) << memory.error().message;
  return std::move(*memory);
}

TEST(ScratchMemory, OfDataSetsTellsWhyItCannotBe) {
  const auto small = ScratchMemory::open_for_data_sets("/var/tmp", 1 << 20);
  ASSERT_FALSE(small);
  EXPECT_EQ(small.error().message, "a budget of 2 MB is too small: at least 4 MB");
  const auto in_memory = ScratchMemory::open_for_data_sets("/dev/shm", kBudget);
  ASSERT_FALSE(in_memory);
  EXPECT_EQ(in_memory.error().message, "the scratch folder '/dev/shm' lies in memory (tmpfs): name one on a disk");
}

// Two threads write all of what is eight times the budget, as one that loads does, and then read here and there; another
// looks how much of it is resident.
TEST(ScratchMemory, OfDataSetsKeepsItsBudgetWhileThreadsWriteAndRead) {
  constexpr std::uint64_t kData = 16 << 20, kMargin = 64 << 20;
  constexpr std::size_t kNumbers = (64 << 20) / sizeof(std::uint32_t);
  const auto memory = open_for_data(kData);
  ScratchMemory::install(*memory);
  std::atomic<int> wrong{0}, working{2};
  const auto work = [&](std::uint32_t salt) {
    auto* const numbers = static_cast<std::uint32_t*>(memory->allocate(kNumbers * sizeof(std::uint32_t)));
    {
      const ScratchMemory::Scope scope(memory.get());
      for (std::size_t i = 0; i < kNumbers; ++i) numbers[i] = std::uint32_t(i) * salt;
    }
    const ScratchMemory::Reading reading;
    std::mt19937 random(salt);
    for (int i = 0; i < 20'000; ++i) {
      const std::size_t at = random() % kNumbers;
      wrong += numbers[at] != std::uint32_t(at) * salt;
    }
    for (std::size_t i = 0; i < kNumbers; ++i) wrong += numbers[i] != std::uint32_t(i) * salt;
    memory->free(numbers);
    --working;
  };
  std::thread one(work, 7), two(work, 9);
  std::uint64_t most = 0;
  while (working != 0) {
    most = std::max(most, memory->keeper()->resident());
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  one.join();
  two.join();
  EXPECT_EQ(wrong, 0);
  if (kAreSignalsPrompt) {
    EXPECT_LE(most, kData + kMargin);
  }
  EXPECT_GE(memory->keeper()->taken_out(), 2 * kNumbers * sizeof(std::uint32_t) - most);
  EXPECT_EQ(memory->array_bytes(), 0u);
}

TEST(ScratchMemory, AScopeIsOfItsThread) {
  const auto memory = open_for_data(kBudget);
  ScratchMemory::install(*memory);
  EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), nullptr);
  {
    const ScratchMemory::Scope scope(memory.get());
    EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), memory.get());
    std::thread([] { EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), nullptr); }).join();
    {
      const ScratchMemory::Scope nothing(nullptr);
      EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), memory.get());
    }
    EXPECT_EQ(ScratchMemory::place_of(SmallArrays::kLeastBytes), memory.get());
    EXPECT_EQ(ScratchMemory::place_of(SmallArrays::kLeastBytes - 1), nullptr);
    // Freed by its address, on any thread.
    void* const array = memory->allocate(1 << 20);
    EXPECT_EQ(memory->array_bytes(), 1u << 20);
    std::thread([array] { EXPECT_TRUE(ScratchMemory::free_installed(array)); }).join();
    EXPECT_EQ(memory->array_bytes(), 0u);
  }
  EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), nullptr);
  const ScratchMemory::Scope none(nullptr);
  EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), nullptr);
}

// What a build has is of all threads, and large.
TEST(ScratchMemory, OfABuildIsOfAllThreads) {
  const TempDir folder;
  const auto memory = open_scratch(folder);
  EXPECT_EQ(memory->keeper(), nullptr);
  ScratchMemory::install(*memory);
  EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), memory.get());
  EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes - 1), nullptr);
  std::thread([&memory] { EXPECT_EQ(ScratchMemory::place_of(ScratchMemory::kLeastBytes), memory.get()); }).join();
}

// A file that is shorter than its mapping stands for a disk that fails.
TEST(ScratchMemory, ADiskThatFailsIsOneLine) {
  const TempDir folder;
  const auto read_what_is_lost = [&folder] {
    const auto memory = open_scratch(folder);
    ScratchMemory::install(*memory);
    const auto* const array = static_cast<const volatile std::byte*>(memory->allocate(1 << 20));
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
      std::error_code gone;  // the folder's own
      const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
      if (target.find(folder.path().string()) == 0 && ::ftruncate(std::stoi(entry.path().filename().string()), 0) != 0) std::abort();
    }
    return array[5];
  };
  EXPECT_EXIT(static_cast<void>(read_what_is_lost()), ::testing::ExitedWithCode(1),
              "^intervale: the disk of the scratch file in '" + folder.path().string() + "' failed\n$");
}

TEST(ScratchMemory, FreesOnlyWhatItOwns) {
  const TempDir folder;
  const auto memory = open_scratch(folder);
  std::byte elsewhere{};
  EXPECT_FALSE(ScratchMemory::free_installed(&elsewhere));
  ScratchMemory::install(*memory);
  void* const array = memory->allocate(1 << 20);
  EXPECT_FALSE(ScratchMemory::free_installed(&elsewhere));
  EXPECT_TRUE(ScratchMemory::free_installed(array));
  EXPECT_EQ(memory->allocate(1 << 20), array);
  EXPECT_TRUE(ScratchMemory::free_installed(array));
}

}  // namespace
}  // namespace intervale
