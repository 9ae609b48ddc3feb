#include "client/net/url.h"

#include <gtest/gtest.h>

namespace intervale {
namespace {

TEST(Url, PartsAreFound) {
  const auto url = parse_url("ws://localhost:8080/bucky ball.2");
  ASSERT_TRUE(url);
  EXPECT_EQ(url->host, "localhost");
  EXPECT_EQ(url->port, "8080");
  EXPECT_EQ(url->name, "bucky ball.2");
  EXPECT_EQ(url->server(), "ws://localhost:8080");
}

TEST(Url, AddressesOfVersion6KeepTheirBrackets) {
  const auto url = parse_url("ws://[::1]:9/x");
  ASSERT_TRUE(url);
  EXPECT_EQ(url->host, "::1");
  EXPECT_EQ(url->authority(), "[::1]:9");
  EXPECT_EQ(parse_url("ws://[fe80::1]").value().port, "80");
}

TEST(Url, NameAndPortMayBeMissing) {
  EXPECT_EQ(parse_url("ws://a.example").value().port, "80");
  EXPECT_EQ(parse_url("ws://a.example:81/").value().name, "");
  EXPECT_EQ(parse_url("ws://a.example:81/x/").value().name, "x");
}

TEST(Url, EscapesInTheNameAreReadAndOthersStay) {
  const auto name_of = [](const std::string& name) { return parse_url("ws://a:1/" + name).value().name; };
  EXPECT_EQ(name_of("bucky%20ball.2"), "bucky ball.2");
  EXPECT_EQ(name_of("%C3%a9t%C3%A9"), "\u00e9t\u00e9");
  EXPECT_EQ(name_of("50%25"), "50%");
  EXPECT_EQ(name_of("%2525"), "%25") << "once only";
  for (const char* name : {"50%", "%2", "%2g", "%-1", "%+1", "%0x", "% 1", "a+b"}) EXPECT_EQ(name_of(name), name);
  EXPECT_FALSE(parse_url("ws://a:1/x%2Fy")) << "it is a slash all the same";
}

TEST(Url, SaysWhetherTheLineIsToBeSecure) {
  EXPECT_EQ(parse_url("ws://a:1/x").value().server(), "ws://a:1");
  EXPECT_EQ(parse_url("wss://a:1/x").value().server(), "wss://a:1");
  EXPECT_EQ(parse_url("wss://a.example").value().port, "443");
}

TEST(Url, OthersAreWrongUsage) {
  for (const char* text : {"",
                           "ws://",
                           "ws:///x",
                           "http://a:1",
                           "https://a:1",
                           "wss:/a",
                           "a:1",
                           "ws://a:0",
                           "ws://a:65536",
                           "ws://a:x",
                           "ws://a:",
                           "ws://[::1",
                           "ws://[::1]x",
                           "ws://[]:1",
                           "ws://[a]:1",
                           "ws://[1.2.3.4%eth0]:1",
                           "ws://a b:1",
                           "ws://::1:80",
                           "ws://a:1/x/y",
                           "ws://a:+1",
                           "ws://a\r\nb:1"}) {
    const auto url = parse_url(text);
    ASSERT_FALSE(url) << text;
    EXPECT_TRUE(url.error().usage) << text;
  }
}

}  // namespace
}  // namespace intervale
