#include "server/serve/request_target.h"

#include <gtest/gtest.h>

#include <array>
#include <string_view>
#include <vector>

namespace intervale {
namespace {

using Hosts = std::vector<std::string_view>;

TEST(RequestTarget, IsThatOfTheLineAndOfTheHostField) {
  for (const char* target : {"/", "/api/datasets?x=http://b/", "*", "relative", "ftp://b/", "http:/b"}) {
    const auto asked = request_target(target, Hosts{"a:8080"}, 11);
    ASSERT_TRUE(asked) << target;
    EXPECT_EQ(asked->target, target);
    EXPECT_EQ(asked->host, "a:8080");
  }
}

TEST(RequestTarget, TheHostOfAUrlCounts) {
  const std::vector<std::array<const char*, 3>> urls{
      {"http://b/x?y", "/x?y", "b"}, {"HTTPS://b:1", "/", "b:1"}, {"http://[::1]:80?y", "/?y", "[::1]:80"}, {"http://b//x/", "//x/", "b"}};
  for (const auto& [url, target, host] : urls) {
    const auto asked = request_target(url, Hosts{"a"}, 11);
    ASSERT_TRUE(asked) << url;
    EXPECT_EQ(asked->target, target);
    EXPECT_EQ(asked->host, host);
  }
  for (const char* url : {"http://", "http:///x", "http://?x", "http://user@b/", "http://b c/"})
    EXPECT_FALSE(request_target(url, Hosts{"a"}, 11)) << url;
}

TEST(RequestTarget, NeedsOneHostFieldThatIsAHost) {
  EXPECT_FALSE(request_target("/", Hosts{}, 11));
  EXPECT_FALSE(request_target("http://b/", Hosts{}, 11));
  EXPECT_TRUE(request_target("/", Hosts{}, 10));
  EXPECT_TRUE(request_target("/", Hosts{""}, 11)) << "of a URL that has none";
  for (const unsigned version : {10U, 11U}) EXPECT_FALSE(request_target("/", Hosts{"a", "a"}, version));
  for (const char* host : {"a b", "a/b", "a@b", "a\x80", "a\tb", "\"a\"", "a?"}) EXPECT_FALSE(request_target("/", Hosts{host}, 11)) << host;
}

}  // namespace
}  // namespace intervale
