// What remote files are named by, and what is sent along: URLs, files of headers, keys, Content-Range.
#include "common/remote/remote_url.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "common/remote/content_range.h"
#include "common/remote/remote_access.h"
#include "tests/support/temp_dir.h"

namespace intervale::remote_urls {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(RemoteUrl, HasAnOriginAndTheNameOfItsFile) {
  const auto url = parse_remote_url("HTTPS://CDN.example/a/my%20scan.ivm?X-Signature=secret#part");
  ASSERT_TRUE(url) << url.error().message;
  EXPECT_EQ(url->origin, "https://cdn.example:443");
  EXPECT_EQ(url->name, "my scan");
  EXPECT_TRUE(url->secure);
  EXPECT_THAT(url->text, HasSubstr("X-Signature=secret"));
  EXPECT_THAT(url->text, Not(HasSubstr("#")));
  EXPECT_THAT(url->shown, Not(HasSubstr("secret")));
  EXPECT_EQ(parse_remote_url("http://[::1]:8000/x.ivm")->origin, "http://[::1]:8000");
  EXPECT_EQ(parse_remote_url("http://a/x%2Fy")->name, "x/y") << "which no catalogue takes";
  EXPECT_EQ(parse_remote_url("http://a/x.ivm")->origin, "http://a:80");
}

TEST(RemoteUrl, OthersAreMisuseAndShowNoSecrets) {
  for (const char* text : {"", "scan.ivm", "ws://a/x", "ftp://a/x.ivm", "file:///etc/passwd", "https://", "https:///x.ivm", "http://a", "http://a/",
                           "http://a/b/", "http://a b/x", "http://a/x y", "http://a:0x/x", "http://a:99999/x", "http://user:secret@a/x.ivm",
                           "https://secret@a/x", "http://user:secret@:x/"}) {
    const auto url = parse_remote_url(text);
    ASSERT_FALSE(url) << text;
    EXPECT_TRUE(url.error().usage) << text;
    EXPECT_THAT(url.error().message, Not(HasSubstr("secret"))) << text;
  }
  EXPECT_TRUE(is_remote_url("Http://x"));
  for (const char* text : {"", "http:", "http:/x", "ws://x", "/data/http://x", "xhttp://x"}) EXPECT_FALSE(is_remote_url(text)) << text;
  EXPECT_EQ(shown_url("https://a/x.ivm?secret"), "https://a/x.ivm");
  EXPECT_EQ(shown_url("a?b.ivm"), "a?b.ivm");
}

TEST(RemoteUrl, RedirectsNeverLeaveHttps) {
  const auto from = parse_remote_url("https://a/b/x.ivm").value();
  EXPECT_EQ(redirected(from, "/y?z")->text, "https://a/y?z");
  EXPECT_EQ(redirected(from, "y")->text, "https://a/b/y");
  EXPECT_EQ(redirected(from, "//c/y")->origin, "https://c:443");
  EXPECT_EQ(redirected(from, "https://c/y")->name, "x") << "the name stays";
  EXPECT_TRUE(redirected(parse_remote_url("http://a/x").value(), "https://a/x"));
  for (const char* to : {"", "http://a/b/x.ivm", "file:///etc/passwd", "ftp://a/x", "https://u:p@a/x"}) EXPECT_FALSE(redirected(from, to)) << to;
}

TEST(HeaderFile, HasNamesAndValues) {
  const TempDir folder;
  const auto good = read_header_file(folder.file("good", "# a comment\r\n\r\nAuthorization: Bearer a:b\nX-Key:  c d \n"));
  ASSERT_TRUE(good) << good.error().message;
  EXPECT_THAT(*good, ElementsAre("Authorization: Bearer a:b", "X-Key: c d"));
  for (const char* text :
       {"secret", ": secret", "A B: secret", "Host: secret", "RANGE: secret", "If-Match: secret", "X: sec\x01ret", "X:", "X: a\nsecret"}) {
    const auto bad = read_header_file(folder.file("bad", text));
    ASSERT_FALSE(bad) << text;
    EXPECT_THAT(bad.error().message, Not(HasSubstr("secret")));
  }
  EXPECT_FALSE(read_header_file(folder.file("large", std::string(70'000, '#'))));
  EXPECT_FALSE(read_header_file(folder / "missing"));
}

TEST(AwsSigning, TakesKeysFromTheEnvironment) {
  ::setenv("AWS_ACCESS_KEY_ID", "AKID", 1);
  ::unsetenv("AWS_SECRET_ACCESS_KEY");
  EXPECT_FALSE(aws_from_environment("eu-west-1"));
  ::setenv("AWS_SECRET_ACCESS_KEY", "secret\n", 1);
  EXPECT_THAT(aws_from_environment("eu-west-1").error().message, Not(HasSubstr("secret")));
  ::setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
  EXPECT_EQ(aws_from_environment("eu-west-1")->key_id, "AKID");
  for (const char* region : {"", "eu west", "eu:s3"}) EXPECT_FALSE(aws_from_environment(region)) << region;
  ::unsetenv("AWS_ACCESS_KEY_ID");
  ::unsetenv("AWS_SECRET_ACCESS_KEY");
}

TEST(ContentRange, IsTakenOnlyIfItIsWhole) {
  const auto range = parse_content_range("bytes 5-9/10");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 5u);
  EXPECT_EQ(range->last, 9u);
  EXPECT_EQ(range->total, 10u);
  for (const char* text : {"", "bytes", "bytes 5-9", "bytes 5-9/*", "bytes */10", "bytes 9-5/10", "bytes 5-10/10", "bytes 5-9/10 ", "bytes -9/10",
                           "bytes +5-9/10", "items 5-9/10", "bytes 5-9/99999999999999999999"}) {
    EXPECT_FALSE(parse_content_range(text)) << text;
  }
}

}  // namespace
}  // namespace intervale::remote_urls
