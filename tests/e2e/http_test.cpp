// What is asked without a WebSocket.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Http, AnswersByMethodAndTarget) {
  const auto server = start();
  const auto ask = [&](const std::string& line) { return talk(server->port(), line + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"); };
  EXPECT_THAT(ask("GET /"), ::testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("text/html"), HasSubstr("buckyball")));
  EXPECT_THAT(ask("GET /api/datasets?x=1"),
              ::testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("application/json"), HasSubstr("\"dims\":[65,65,65]")));
  EXPECT_THAT(ask("GET /healthz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("GET /readyz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("GET /metrics"), ::testing::AllOf(HasSubstr("version=0.0.4"), HasSubstr("\nintervale_sessions 0\n")));
  EXPECT_THAT(ask("HEAD /"), ::testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("Content-Length"), Not(HasSubstr("<html"))));
  EXPECT_THAT(ask("POST /"), ::testing::AllOf(StartsWith("HTTP/1.1 405"), HasSubstr("Allow: GET, HEAD")));
  EXPECT_THAT(ask("GET /../etc/passwd"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(ask("GET /v1/stream"), StartsWith("HTTP/1.1 426"));
}

TEST(Http, ServesTheViewerFromMemory) {
  std::unique_ptr<Server> server;
  const auto ask = [&](const std::string& lines) { return talk(server->port(), lines + "\r\nHost: a:1\r\nConnection: close\r\n\r\n"); };
  {
    const TempDir folder;
    folder.file("index.html", "<html>viewer");
    folder.file("app.js", "let a;");
    folder.file("app.js.gz", "packed");
    ServeOptions options;
    options.viewer = folder.path();
    options.connect_origins = {"https://cdn.example"};
    server = start(options);
  }
  const std::string page = ask("GET / HTTP/1.1");
  EXPECT_THAT(page, ::testing::AllOf(
                        StartsWith("HTTP/1.1 200"), HasSubstr("<html>viewer"), HasSubstr("Content-Security-Policy: default-src 'none'; script-src"),
                        HasSubstr("ws://a:1 wss://a:1 https://cdn.example; worker-src"), HasSubstr("Cross-Origin-Opener-Policy: same-origin"),
                        HasSubstr("Referrer-Policy: no-referrer"), HasSubstr("X-Content-Type-Options: nosniff")));
  const std::string packed = ask("GET /app.js HTTP/1.1\r\nAccept-Encoding: gzip");
  EXPECT_THAT(packed, ::testing::AllOf(HasSubstr("Content-Encoding: gzip"), HasSubstr("Content-Length: 6"), HasSubstr("\r\n\r\npacked")));
  EXPECT_THAT(ask("HEAD /app.js HTTP/1.1"), ::testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("Content-Length: 6"), Not(HasSubstr("let"))));
  const std::size_t etag = packed.find("ETag: ");
  ASSERT_NE(etag, std::string::npos);
  const std::string tag = packed.substr(etag + 6, packed.find('\r', etag) - etag - 6);
  EXPECT_THAT(ask("GET /app.js HTTP/1.1\r\nAccept-Encoding: gzip\r\nIf-None-Match: " + tag),
              ::testing::AllOf(StartsWith("HTTP/1.1 304"), HasSubstr(tag), Not(HasSubstr("Content-Length")), ::testing::EndsWith("\r\n\r\n")));
  EXPECT_THAT(ask("GET /%2e%2e/app.js HTTP/1.1"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(ask("GET /%00 HTTP/1.1"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(ask("GET /api/datasets HTTP/1.1"), HasSubstr("Content-Security-Policy: default-src 'none'\r\n"));
}

TEST(Http, AViewerThatIsNotThereIsAnError) {
  ServeOptions options;
  options.listen = "127.0.0.1:0";
  options.viewer = "/nonexistent";
  const auto server = Server::start(options);
  ASSERT_FALSE(server);
  EXPECT_THAT(server.error().message, HasSubstr("/nonexistent"));
}

TEST(Http, KeepsTheConnectionForTheNextRequest) {
  const auto server = start();
  const std::string answers =
      talk(server->port(), "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\nGET /readyz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_NE(answers.find("HTTP/1.1 200"), answers.rfind("HTTP/1.1 200"));
}

TEST(Http, WhatIsNoRequestIsToldSo) {
  const auto server = start();
  EXPECT_THAT(talk(server->port(), std::string(100, '\x01') + "\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(talk(server->port(), "GET / HTTP/1.1\r\nX: " + std::string(5000, 'x') + "\r\n\r\n"), StartsWith("HTTP/1.1 431"));
  std::string many = "GET / HTTP/1.1\r\nHost: x\r\n";
  for (int i = 0; i < 1000; ++i) many += "A: b\r\n";
  for (const std::size_t piece : {many.size(), std::size_t(3000), std::size_t(100)})
    EXPECT_THAT(talk(server->port(), many + "\r\n", piece), StartsWith("HTTP/1.1 431")) << piece;
  EXPECT_THAT(talk(server->port(), many, 1000), StartsWith("HTTP/1.1 431")) << "without an end";
  const std::string upgrade =
      "GET /v1/stream HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  EXPECT_THAT(talk(server->port(), upgrade), StartsWith("HTTP/1.1 400"));  // our subprotocol is not offered
}

// RFC 9112, sections 3.2 and 5.2.
TEST(Http, ARequestNamesOneHostInOneLine) {
  const auto server = start();
  const auto ask = [&](const std::string& lines) { return talk(server->port(), "GET /healthz HTTP/1." + lines + "Connection: close\r\n\r\n"); };
  EXPECT_THAT(ask("1\r\nHost: x\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("0\r\n"), StartsWith("HTTP/1.0 200"));
  EXPECT_THAT(ask("1\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(ask("1\r\nHost: x\r\nHost: x\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(ask("1\r\nHost: x y\r\n"), StartsWith("HTTP/1.1 400"));
  for (const char* fold : {"\r\n ", "\r\n\t", " \r\n  "}) {
    EXPECT_THAT(ask("1\r\nHost: x\r\nAccept: a," + std::string(fold) + "b\r\n"), StartsWith("HTTP/1.1 400"));
    EXPECT_THAT(ask("1\r\nHost:" + std::string(fold) + "x\r\n"), StartsWith("HTTP/1.1 400"));
  }
}

TEST(Http, ATargetMayBeAUrlWhoseHostCounts) {
  const TempDir folder;
  folder.file("index.html", "<html>viewer");
  ServeOptions options;
  options.viewer = folder.path();
  const auto server = start(options);
  const auto ask = [&](const std::string& url) { return talk(server->port(), "GET " + url + " HTTP/1.1\r\nHost: a:1\r\nConnection: close\r\n\r\n"); };
  EXPECT_THAT(ask("http://b:2/api/datasets"), ::testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("buckyball")));
  EXPECT_THAT(ask("http://b:2"), ::testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("ws://b:2 wss://b:2"), Not(HasSubstr("a:1"))));
  EXPECT_THAT(ask("http://b:2/v1/stream"), StartsWith("HTTP/1.1 426"));
  EXPECT_THAT(ask("http:///healthz"), StartsWith("HTTP/1.1 400"));
}

TEST(Http, ARequestMayComeByteByByte) {
  const auto server = start();
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\nGET /readyz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";
  const std::string answers = talk(server->port(), request, 1);
  EXPECT_THAT(answers, StartsWith("HTTP/1.1 200"));
  EXPECT_NE(answers.find("HTTP/1.1 200", 1), std::string::npos);
}

}  // namespace
}  // namespace intervale
