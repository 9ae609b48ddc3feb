#include "server/serve/catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/ivm/every_range.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "server/serve/http_routes.h"
#include "tests/support/analytic_fields.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

Result<void> add(Catalogue& catalogue, std::string name) {
  Volume volume = testing::gyroid({2, 2, 2});
  volume.name = std::move(name);
  return catalogue.add(std::make_shared<const IntervalVolume>(FieldHierarchy(volume, {.range = {-0.3, 0.2}}).compact().value()));
}

TEST(Catalogue, NamesAreUtf8) {
  Catalogue catalogue;
  for (const char* name :
       {"engine", "\xc3\xa9", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf", "a\xc2\xa0z"}) {
    EXPECT_TRUE(add(catalogue, name)) << name;
  }
  for (const char* name : {"\x80", "a\xc3", "\xc3(", "\xc0\xaf", "\xc1\xbf", "\xe0\x9f\xbf", "\xe2\x82", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf",
                           "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff"}) {
    const auto added = add(catalogue, name);
    ASSERT_FALSE(added) << name;
    EXPECT_THAT(added.error().message, HasSubstr("UTF-8"));
  }
  const Metrics metrics;
  const Memory memory;
  const StaticFiles viewer;
  const auto listed = respond({.method = "GET", .target = "/api/datasets", .scope = Scope::everything().get()},
                              {.catalogue = catalogue, .metrics = metrics, .memory = memory, .viewer = viewer});
  EXPECT_EQ(listed.status, 200u) << "JSON can hold every name there is";
}

TEST(Catalogue, ADescriptionFitsAMessage) {
  std::mt19937_64 random(1);
  std::vector<double> samples(40 * 40 * 40);
  for (double& v : samples) v = double(random());
  Volume volume = testing::volume_of_type(SampleType::f64, {40, 40, 40}, samples);
  volume.name = "noise";
  Catalogue catalogue;
  const auto added = catalogue.add(std::make_shared<const IntervalVolume>(FieldHierarchy(volume, {.range = {1e18, 2e18}}).compact().value()));
  ASSERT_FALSE(added);
  EXPECT_THAT(added.error().message, HasSubstr("'noise': the table of its "));
  EXPECT_THAT(added.error().message, HasSubstr("--step S"));
}

TEST(Catalogue, OneDataSetTellsItsStatistics) {
  Volume volume = testing::gyroid({5, 4, 3});
  volume.name = "any range";
  const ValueFormat format = choose_value_format(volume, {}).value();
  round_samples(volume, format);
  Catalogue catalogue;
  ASSERT_TRUE(catalogue.add(std::make_shared<const IntervalVolume>(of_every_range(build_value_volume(volume, format).take()).value())));
  ASSERT_TRUE(add(catalogue, "one"));
  const Metrics metrics;
  const Memory memory;
  const StaticFiles viewer;
  const auto ask = [&](std::string_view target, const Scope* scope) {
    return respond({.method = "GET", .target = target, .scope = scope},
                   {.catalogue = catalogue, .metrics = metrics, .memory = memory, .viewer = viewer});
  };
  const auto all = Scope::everything();
  const auto json = nlohmann::json::parse(*ask("/api/datasets/any%20range", all.get()).body);
  EXPECT_EQ(json.at("name"), "any range");
  EXPECT_EQ(json.at("scope"), "every");
  std::uint64_t samples = 0;
  for (const auto& bin : json.at("histogram")) samples += bin.get<std::uint64_t>();
  EXPECT_EQ(samples, volume.grid.sample_count());
  EXPECT_GT(json.at("histogram_width").get<double>(), 0);
  const auto& volumes = json.at("volumes");
  EXPECT_EQ(volumes.at("values").front(), json.at("values").at("least"));
  EXPECT_EQ(volumes.at("values").back(), json.at("values").at("greatest"));
  EXPECT_EQ(volumes.at("below").front(), 0.0);
  EXPECT_EQ(volumes.at("not_above").back(), 1.0);

  EXPECT_FALSE(nlohmann::json::parse(*ask("/api/datasets/one", all.get()).body).contains("histogram"));
  for (const char* target : {"/api/datasets/", "/api/datasets/none", "/api/datasets/one/", "/api/datasetsx"})
    EXPECT_EQ(ask(target, all.get()).status, 404u);
  EXPECT_EQ(ask("/api/datasets/one", nullptr).status, 401u);
}

TEST(Catalogue, NamesAreUniquePathSegmentsOfAUrl) {
  Catalogue catalogue;
  for (const std::string& name : {std::string("a b"), std::string(255, 'x')}) EXPECT_TRUE(add(catalogue, name)) << name;
  for (const std::string& name : {std::string(), std::string(256, 'x'), std::string("a/b"), std::string("a?b"), std::string("a#b"),
                                  std::string("a\nb"), std::string("a\xc2\x9bz"), std::string("a b")}) {
    EXPECT_FALSE(add(catalogue, name)) << name;
  }
}

}  // namespace
}  // namespace intervale
