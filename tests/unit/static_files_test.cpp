#include "server/serve/static_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "server/serve/http_routes.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;

struct Viewer {
  TempDir folder;
  Viewer() {
    std::filesystem::create_directories(folder / "assets");
    folder.file("index.html", "<html>");
    folder.file("favicon.svg", "<svg/>");
    folder.file("assets/index-BVx3_a9Z.js", "let a = 1;");
    folder.file("assets/index-BVx3_a9Z.js.gz", "packed");
    folder.file("assets/core-0123abcd.wasm", "\0asm");
    folder.file("assets/my-textures.js", "word");
  }
  [[nodiscard]] StaticFiles load() const { return StaticFiles::load(folder.path()).value(); }
};

HttpResponse get(const StaticFiles& viewer, HttpRequest request) {
  const Catalogue catalogue;
  const Metrics metrics;
  const Memory memory;
  if (request.method.empty()) request.method = "GET";
  request.scope = Scope::everything().get();
  return respond(request, {.catalogue = catalogue, .metrics = metrics, .memory = memory, .viewer = viewer});
}

std::string body_of(const HttpResponse& answer) { return answer.body ? *answer.body : "none"; }

TEST(StaticFiles, AreAnsweredByTheirNameAndType) {
  const StaticFiles files = Viewer().load();
  EXPECT_EQ(body_of(get(files, {.target = "/"})), "<html>");
  EXPECT_EQ(body_of(get(files, {.target = "/?at=1,2,3"})), "<html>");
  EXPECT_EQ(body_of(get(files, {.target = "/index.html"})), "<html>");
  EXPECT_EQ(body_of(get(files, {.target = "/%66avicon.svg"})), "<svg/>");
  EXPECT_EQ(get(files, {.target = "/"}).content_type, "text/html; charset=utf-8");
  EXPECT_EQ(get(files, {.target = "/favicon.svg"}).content_type, "image/svg+xml");
  EXPECT_EQ(get(files, {.target = "/assets/index-BVx3_a9Z.js"}).content_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(get(files, {.target = "/assets/core-0123abcd.wasm"}).content_type, "application/wasm");
  EXPECT_EQ(get(files, {.method = "POST", .target = "/favicon.svg"}).status, 405u);
  EXPECT_EQ(get(files, {.target = "/api/datasets"}).content_type, "application/json") << "files hide nothing of the server's own";
}

TEST(StaticFiles, StayInTheirFolder) {
  const Viewer viewer;
  const TempDir outside;
  const std::filesystem::path secret = outside.file("secret.txt", "secret");
  std::filesystem::create_symlink(secret, viewer.folder / "link.txt");
  std::filesystem::create_directory_symlink(outside.path(), viewer.folder / "out");
  std::filesystem::create_symlink(viewer.folder / "favicon.svg", viewer.folder / "icon.svg");
  viewer.folder.file(".hidden.txt", "hidden");
  std::filesystem::create_directory(viewer.folder / ".git");
  viewer.folder.file(".git/config.txt", "hidden");
  const StaticFiles files = viewer.load();
  EXPECT_EQ(body_of(get(files, {.target = "/icon.svg"})), "<svg/>");
  for (const char* target :
       {"/link.txt", "/out/secret.txt", "/.hidden.txt", "/.git/config.txt", "/../secret.txt", "/assets/../favicon.svg", "/%2e%2e/secret.txt",
        "//favicon.svg", "/favicon.svg/", "/./favicon.svg", "/assets", "/assets/", "/assets\\..\\favicon.svg", "/assets/index-BVx3_a9Z.js.gz"}) {
    EXPECT_EQ(get(files, {.target = target}).status, 404u) << target;
  }
  EXPECT_EQ(get(files, {.target = "/" + std::string(4000, 'a')}).status, 404u);
  for (const char* target : {"favicon.svg", "", "/%", "/%4", "/%zz", "/%00", "/favicon.svg%00.html", "*", "http://x/favicon.svg"}) {
    EXPECT_EQ(get(files, {.target = target}).status, 400u) << target;
  }
}

TEST(StaticFiles, GoPackedToWhoTakesThem) {
  const StaticFiles files = Viewer().load();
  const std::string target = "/assets/index-BVx3_a9Z.js";
  const HttpResponse plain = get(files, {.target = target});
  const HttpResponse packed = get(files, {.target = target, .accept_encoding = "br, gzip"});
  EXPECT_EQ(body_of(plain), "let a = 1;");
  EXPECT_EQ(body_of(packed), "packed");
  EXPECT_EQ(packed.content_type, plain.content_type);
  EXPECT_THAT(packed.headers, Contains(Pair("Content-Encoding", "gzip")));
  EXPECT_THAT(plain.headers, Not(Contains(Pair("Content-Encoding", "gzip"))));
  for (const HttpResponse& each : {plain, packed}) EXPECT_THAT(each.headers, Contains(Pair("Vary", "Accept-Encoding")));
  EXPECT_EQ(body_of(get(files, {.target = "/favicon.svg", .accept_encoding = "gzip"})), "<svg/>");
}

TEST(StaticFiles, ReadAcceptEncoding) {
  for (const char* yes : {"gzip", "GZIP", "br;q=1, gzip;q=0.1", "x-gzip", "*", "deflate,\tgzip ; q=1.000", "identity;q=0, *;q=0.5"}) {
    EXPECT_TRUE(accepts_gzip(yes)) << yes;
  }
  for (const char* no : {"", "br", "gzip;q=0", "gzip; Q=0.0, br", "*;q=0", "gzip;q=0, *;q=1", "gzip;q=", "gzip;q=nan", "gzip;q=inf", "gzip;q=2",
                         "gzip;q=1e-1", "gzip;q=1x", "gzipped", ",,;"}) {
    EXPECT_FALSE(accepts_gzip(no)) << no;
  }
}

TEST(StaticFiles, AreSentOnceToWhoRemembersThem) {
  const StaticFiles files = Viewer().load();
  const std::string target = "/assets/index-BVx3_a9Z.js";
  const auto tag_of = [](const HttpResponse& answer) { return answer.headers.front().second; };
  const std::string plain = tag_of(get(files, {.target = target}));
  const std::string packed = tag_of(get(files, {.target = target, .accept_encoding = "gzip"}));
  EXPECT_NE(plain, packed);
  const HttpResponse again = get(files, {.target = target, .accept_encoding = "gzip", .if_none_match = packed});
  EXPECT_EQ(again.status, 304u);
  EXPECT_EQ(again.body, nullptr);
  EXPECT_EQ(tag_of(again), packed);
  EXPECT_THAT(again.headers, Contains(Pair("Vary", "Accept-Encoding")));
  EXPECT_EQ(get(files, {.target = target, .if_none_match = "\"x\", W/" + plain}).status, 304u);
  EXPECT_EQ(get(files, {.target = target, .if_none_match = "*"}).status, 304u);
  EXPECT_EQ(get(files, {.target = target, .if_none_match = packed}).status, 200u);
  EXPECT_EQ(get(files, {.target = target, .if_none_match = "\"x\""}).status, 200u);
}

TEST(StaticFiles, OnlyNamesThatChangeWithTheirContentAreKeptForEver) {
  const StaticFiles files = Viewer().load();
  for (const char* target : {"/assets/index-BVx3_a9Z.js", "/assets/core-0123abcd.wasm"}) {
    EXPECT_THAT(get(files, {.target = target}).cache_control, HasSubstr("immutable")) << target;
  }
  for (const char* target : {"/", "/favicon.svg", "/assets/my-textures.js"})
    EXPECT_EQ(get(files, {.target = target}).cache_control, "no-cache") << target;
}

TEST(StaticFiles, PagesMayReachTheirOwnHostOnly) {
  const StaticFiles files = Viewer().load();
  const auto policy = [&files](std::string_view host) { return get(files, {.target = "/", .host = host}).content_security_policy; };
  EXPECT_THAT(policy("example.org:8080"), HasSubstr("connect-src 'self' ws://example.org:8080 wss://example.org:8080; worker-src"));
  for (const char* host : {"", "[::1]:8080", "x; script-src *", "x'y", "a b"}) {
    EXPECT_THAT(policy(host), HasSubstr("connect-src 'self' ws: wss:; worker-src")) << host;
  }
  EXPECT_EQ(get(files, {.target = "/api/datasets"}).content_security_policy, "default-src 'none'");
}

TEST(StaticFiles, PagesMayReachTheOriginsThatTheServerNames) {
  for (const char* origin : {"https://cdn.example", "http://127.0.0.1:8000", "https://a-b.c:65535"}) EXPECT_TRUE(is_connect_origin(origin)) << origin;
  for (const char* origin : {"",
                             "*",
                             "https://",
                             "cdn.example",
                             "ws://a",
                             "https://*",
                             "https://a/",
                             "https://a/x",
                             "https://a b",
                             "https://a;script-src",
                             "https://a'",
                             "https://u@a",
                             "https://a:",
                             "https://a:0",
                             "https://a:65536",
                             "https://a:8x",
                             "https://[::1]",
                             "https://a?b",
                             "https://:80",
                             "https://\xc3\xa4"}) {
    EXPECT_FALSE(is_connect_origin(origin)) << origin;
  }
}

TEST(StaticFiles, WithoutAViewerThePlainPageRemains) {
  const HttpResponse page = get({}, {.target = "/"});
  EXPECT_THAT(body_of(page), HasSubstr("no viewer"));
  EXPECT_EQ(page.content_security_policy, "default-src 'none'");
  EXPECT_EQ(get({}, {.target = "/index.html"}).status, 404u);
}

TEST(StaticFiles, WhatIsNoViewerIsAnError) {
  const TempDir folder;
  EXPECT_FALSE(StaticFiles::load(folder.path()));
  EXPECT_FALSE(StaticFiles::load(folder / "nowhere"));
  folder.file("index.html", "<html>");
  EXPECT_TRUE(StaticFiles::load(folder.path()));
  folder.file("large.bin", "");
  std::filesystem::resize_file(folder / "large.bin", kMaxStaticBytes);
  const auto large = StaticFiles::load(folder.path());
  ASSERT_FALSE(large);
  EXPECT_THAT(large.error().message, HasSubstr("large.bin"));
}

}  // namespace
}  // namespace intervale
