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
