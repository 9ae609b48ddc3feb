#include "client/load/load_stats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

namespace intervale {
namespace {

// The definition, the slow way.
double nearest_rank(const std::vector<double>& samples, int percent) {
  auto sorted = samples;
  std::sort(sorted.begin(), sorted.end());
  for (double candidate : sorted) {
    const auto within = std::count_if(sorted.begin(), sorted.end(), [&](double x) { return x <= candidate; });
    if (100 * within >= std::ptrdiff_t(samples.size()) * percent) return candidate;
  }
  return sorted.back();
}

TEST(Percentiles, AreByNearestRank) {
  std::mt19937 random(1);
  for (std::size_t size = 1; size < 250; ++size) {
    std::vector<double> samples(size);
    for (double& x : samples) x = double(random() % 100);
    const auto p = percentiles_of(samples);
    ASSERT_TRUE(p);
    EXPECT_EQ(p->p50, nearest_rank(samples, 50)) << size;
    EXPECT_EQ(p->p95, nearest_rank(samples, 95)) << size;
    EXPECT_EQ(p->p99, nearest_rank(samples, 99)) << size;
    EXPECT_EQ(p->max, *std::max_element(samples.begin(), samples.end())) << size;
  }
}

TEST(Percentiles, OfNothingAreNothing) { EXPECT_FALSE(percentiles_of({})); }

TEST(LoadStats, AddUp) {
  LoadStats a;
  a.connected = 2;
  a.failed = 1;
  a.updates = 10;
  a.first_mesh_ms = {1, 2};
  a.errors = {{"lost", 1}};
  LoadStats b = a;
  b.view_change_ms = {7};
  b.view_done_ms = {9};
  b.view_bytes = {100};
  b.set_range_ms = {3};
  b.errors = {{"lost", 2}, {"late", 1}};
  a.add(std::move(b));
  EXPECT_EQ(a.connected, 4u);
  EXPECT_EQ(a.failed, 2u);
  EXPECT_EQ(a.updates, 20u);
  EXPECT_EQ(a.first_mesh_ms, (std::vector<double>{1, 2, 1, 2}));
  EXPECT_EQ(a.view_change_ms, std::vector<double>{7});
  EXPECT_EQ(a.view_done_ms, std::vector<double>{9});
  EXPECT_EQ(a.view_bytes, std::vector<double>{100});
  EXPECT_EQ(a.set_range_ms, std::vector<double>{3});
  EXPECT_EQ(a.errors, (std::map<std::string, std::uint64_t>{{"lost", 3}, {"late", 1}}));
}

TEST(LoadReport, JsonHasItsKeys) {
  LoadReport report;
  report.clients = 3;
  report.seconds = 2;
  report.stats.updates = 5;
  report.stats.bytes = 9;
  report.stats.first_mesh_ms = {1, 2, 3};
  report.stats.errors = {{"lost", 2}};
  auto json = to_json(report);
  for (const char* key : {"clients", "connected", "failed", "updates", "bytes", "updates_per_s", "bytes_per_s", "first_mesh_ms", "first_mesh_bytes",
                          "view_change_ms", "view_done_ms", "view_bytes", "stale_bytes", "set_range_ms", "errors"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json.at("updates_per_s"), 2.5);
  EXPECT_EQ(json.at("bytes_per_s"), 4.5);
  EXPECT_EQ(json.at("first_mesh_ms").at("p50"), 2.0);
  EXPECT_TRUE(json.at("view_change_ms").at("p99").is_null());
  EXPECT_EQ(json.at("errors"), 2);
  EXPECT_FALSE(json.contains("verified"));
  report.verified = 3;
  report.differing = 1;
  json = to_json(report);
  EXPECT_EQ(json.at("verified"), 3);
  EXPECT_EQ(json.at("errors"), 3);
}

TEST(LoadReport, ARunWithoutTimeHasNoRates) { EXPECT_EQ(to_json(LoadReport{}).at("updates_per_s"), 0.0); }

}  // namespace
}  // namespace intervale
