#include "server/serve/catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/builder/field_hierarchy.h"
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
  const StaticFiles viewer;
  const auto listed = respond({.method = "GET", .target = "/api/datasets", .scope = Scope::everything().get()},
                              {.catalogue = catalogue, .metrics = metrics, .viewer = viewer});
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
