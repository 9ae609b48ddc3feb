// The parts of the model of bench_scaling.
#include "tests/bench/scaling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <list>
#include <random>
#include <utility>
#include <vector>

namespace intervale::bench {
namespace {

// Pages in the order in which they were used, the last one first.
class NaiveLru {
 public:
  explicit NaiveLru(std::uint64_t most) : most_(most) {}
  bool touch(std::uint64_t page, std::uint32_t bytes) {
    const auto found = std::find_if(pages_.begin(), pages_.end(), [&](const auto& p) { return p.first == page; });
    const bool hit = found != pages_.end();
    if (!hit && bytes > most_) return false;
    if (hit) pages_.erase(found);
    pages_.emplace_front(page, bytes);
    while (this->bytes() > most_) pages_.pop_back();
    return hit;
  }
  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t sum = 0;
    for (const auto& p : pages_) sum += p.second;
    return sum;
  }
  [[nodiscard]] std::size_t pages() const { return pages_.size(); }

 private:
  std::uint64_t most_;
  std::list<std::pair<std::uint64_t, std::uint32_t>> pages_;
};

TEST(LruCache, DoesWhatANaiveOneDoes) {
  for (const std::uint64_t most : {0u, 10u, 100u, 1000u}) {
    std::mt19937 random(7);
    LruCache cache(most);
    NaiveLru naive(most);
    for (int i = 0; i < 20000; ++i) {
      const std::uint64_t page = random() % 40;
      const auto bytes = std::uint32_t(1 + page * 3);  // some are larger than the cache
      ASSERT_EQ(cache.touch(page, bytes), naive.touch(page, bytes)) << "touch " << i << " of " << most << " bytes";
      ASSERT_EQ(cache.bytes(), naive.bytes());
      ASSERT_EQ(cache.pages(), naive.pages());
      ASSERT_LE(cache.bytes(), most);
    }
  }
}

TEST(Zipf, SharesAddUpToOneAndFallAsTheLawSays) {
  const Zipf zipf(1000, 0.9);
  double sum = 0;
  for (std::uint32_t k = 0; k < 1000; ++k) {
    sum += zipf.share(k);
    EXPECT_NEAR(zipf.share(k) / zipf.share(0), std::pow(k + 1.0, -0.9), 1e-9);
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_EQ(zipf.at(0), 0u);
  EXPECT_EQ(zipf.at(std::nextafter(1.0, 0.0)), 999u);
  EXPECT_EQ(zipf.at(zipf.share(0) * 0.999), 0u);
  EXPECT_EQ(zipf.at(zipf.share(0) * 1.001), 1u);
}

// One page, a read each second by each client.
std::vector<Template> one_page() {
  Template t{.page_bytes = {50}, .page_values = {100}, .bytes_a_value = 1, .seconds_a_value = 0.001, .head_bytes = 10, .users = {{}}, .drags = {}};
  t.users[0].seconds.assign(10, {.cpu_seconds = 0.1, .bytes = 7, .updates = 3, .pages = {0}, .firsts = {}});
  return {t};
}

TEST(Simulation, CountsWhatSessionsDo) {
  const Rates none = simulate({.clients = 100, .replicas = 2, .data_sets = 5, .cache_bytes = 0}, one_page());
  EXPECT_DOUBLE_EQ(none.reads, 100);
  EXPECT_DOUBLE_EQ(none.misses, 100);
  EXPECT_DOUBLE_EQ(none.miss_bytes, 5000);
  EXPECT_NEAR(none.decoding, 10, 1e-9);
  EXPECT_NEAR(none.cpu, 10, 1e-9);
  EXPECT_DOUBLE_EQ(none.bytes, 700);
  EXPECT_DOUBLE_EQ(none.updates, 300);
  const Rates all = simulate({.clients = 100, .replicas = 2, .data_sets = 5, .cache_bytes = 500}, one_page());
  EXPECT_DOUBLE_EQ(all.misses, 0) << "all five pages fit, and are there once the model has warmed up";
  EXPECT_DOUBLE_EQ(all.cached_bytes, 1000);
}

TEST(Simulation, ADataSetIsAtOneReplicaUnlessItIsSpread) {
  Crowd crowd{.clients = 200, .replicas = 8, .data_sets = 1, .routing = Routing::hashed, .cache_bytes = 1000};
  EXPECT_NEAR(simulate(crowd, one_page()).fullest, 8, 1e-9);
  crowd.routing = Routing::spread;
  EXPECT_LT(simulate(crowd, one_page()).fullest, 1.3);
  crowd.data_sets = 10000;
  EXPECT_LT(simulate(crowd, one_page()).fullest, 1.3);
  crowd.routing = Routing::random;
  EXPECT_LT(simulate(crowd, one_page()).fullest, 2);
}

}  // namespace
}  // namespace intervale::bench
