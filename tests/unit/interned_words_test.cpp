#include "common/util/interned_words.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <thread>
#include <vector>

namespace intervale {
namespace {

using Number = InternedWords::Number;

TEST(InternedWords, HaveANumberOfTheirOwnAsLongAsTheyAreUsed) {
  const auto words = std::make_unique<InternedWords>();
  std::mt19937_64 random(5);
  std::vector<std::uint64_t> pool(300);  // small ones, and any
  for (std::size_t i = 0; i < pool.size(); ++i) pool[i] = i < 50 ? i : random();
  struct Use {
    Number number = 0;
    int uses = 0;
  };
  std::map<std::uint64_t, Use> model;
  for (int step = 0; step < 100'000; ++step) {
    const std::uint64_t word = pool[random() % pool.size()];
    Use& use = model[word];
    if (use.uses > 0 && random() % 2 == 0) {
      words->release(use.number);
      --use.uses;
      continue;
    }
    if (use.uses > 0 && random() % 4 == 0) {
      words->use_again(use.number);
    } else {
      const auto number = words->use(word);
      ASSERT_TRUE(number);
      ASSERT_LT(*number, InternedWords::kLimit);
      ASSERT_TRUE(use.uses == 0 || *number == use.number);
      use.number = *number;
    }
    ++use.uses;
    if (step % 100 != 0) continue;
    std::set<Number> numbers;
    for (const auto& [one, is] : model) {
      if (is.uses == 0) continue;
      ASSERT_EQ((*words)[is.number], one);
      ASSERT_TRUE(numbers.insert(is.number).second) << "two words have a number";
    }
  }
}

TEST(InternedWords, HaveNoNumbersWhenAllAreTakenAndAgainOnceSomeAreFree) {
  const auto words = std::make_unique<InternedWords>();
  std::mt19937_64 random(6);
  std::vector<Number> taken;
  int refused = 0;
  for (std::size_t i = 0; i < 2 * InternedWords::kMost; ++i) {
    if (const auto number = words->use(random())) {
      taken.push_back(*number);
    } else {
      ++refused;
    }
  }
  EXPECT_EQ(taken.size(), InternedWords::kMost);
  EXPECT_EQ(refused, int(InternedWords::kMost));
  for (const Number number : taken) words->release(number);
  for (std::size_t i = 0; i < 1000; ++i) EXPECT_TRUE(words->use(random()));
}

TEST(InternedWords, AreTheSameForAllThreads) {
  const auto words = std::make_unique<InternedWords>();
  const auto work = [&words](unsigned seed) {
    std::mt19937_64 random(seed);
    std::vector<std::pair<std::uint64_t, Number>> mine;
    for (int step = 0; step < 50'000; ++step) {
      if (mine.size() > 3) {
        std::swap(mine[random() % mine.size()], mine.back());
        words->release(mine.back().second);
        mine.pop_back();
      }
      const std::uint64_t word = random() % 16;
      mine.emplace_back(word, *words->use(word));
      for (const auto& [one, number] : mine) ASSERT_EQ((*words)[number], one);
    }
    for (const auto& [one, number] : mine) words->release(number);
  };
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (unsigned seed = 0; seed < 4; ++seed) threads.emplace_back(work, seed);
  for (std::thread& thread : threads) thread.join();
  std::set<Number> numbers;
  for (std::uint64_t word = 0; word < 1000; ++word) EXPECT_TRUE(numbers.insert(*words->use(word)).second);
}

}  // namespace
}  // namespace intervale
