// TLS at both ends: whom clients trust, and a certificate that changes while the server runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/net/fetch.h"
#include "client/net/http_get.h"
#include "server/serve/catalogue_watcher.h"
#include "server/serve/server.h"
#include "tests/support/certificates.h"
#include "tests/support/peers.h"
#include "tests/support/programs.h"
#include "tests/support/raw_client.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

struct Secured {
  TempDir folder;
  CertificateFiles files;
  std::unique_ptr<Server> server;
  explicit Secured(const CertificateWish& wish = {}, ServeOptions options = {}) : files(make_certificate(folder.path(), "server", wish)) {
    spdlog::set_level(spdlog::level::off);
    options.listen = "127.0.0.1:0";
    options.threads = 2;
    options.tls = TlsFiles{files.certificate, files.key};
    server = Server::start(options).value();
    server->offer(CatalogueWatcher({buckyball()}, server->memory()).load().value());
  }
  [[nodiscard]] ServerUrl url(const std::string& host = "127.0.0.1") const {
    ServerUrl url = parse_url("wss://" + host + ":" + std::to_string(server->port()) + "/buckyball").value();
    url.access.authorities = files.certificate;
    return url;
  }
};

Result<Fetched> fetch_coarse(const ServerUrl& url) {
  FetchOptions options;
  options.lod.error_percent = 20;
  options.reconnect = std::chrono::seconds(0);
  return fetch(url, options, {});
}

TEST(Tls, CarriesTheSameStream) {
  const Secured secured;
  EXPECT_THAT(secured.server->url(), ::testing::StartsWith("https://"));
  ServeOptions plain;
  plain.listen = "127.0.0.1:0";
  const auto server = Server::start(plain).value();
  server->offer(CatalogueWatcher({buckyball()}, server->memory()).load().value());
  const auto over_tcp = fetch(parse_url("ws://127.0.0.1:" + std::to_string(server->port()) + "/buckyball").value(), {}, {});
  for (const char* host : {"127.0.0.1", "localhost"}) {
    const auto over_tls = fetch(secured.url(host), {}, {});
    ASSERT_TRUE(over_tls) << over_tls.error().message;
    EXPECT_EQ(over_tls->client.mesh().tets, over_tcp->client.mesh().tets);
  }
  const auto list = http_get(secured.url(), "/api/datasets");
  ASSERT_TRUE(list) << list.error().message;
  EXPECT_THAT(*list, HasSubstr("buckyball"));
}

TEST(Tls, IsForServersThatAreTrustedOnly) {
  const auto complaint_of = [](const ServerUrl& url) {
    const auto fetched = fetch_coarse(url);
    const auto listed = http_get(url, "/api/datasets");
    EXPECT_FALSE(fetched);
    EXPECT_FALSE(listed);
    if (fetched || listed) return std::string();
    EXPECT_EQ(fetched.error().message, listed.error().message);
    return fetched.error().message;
  };
  const Secured secured;
  ServerUrl unknown = secured.url();
  unknown.access.authorities.reset();
  EXPECT_THAT(complaint_of(unknown), ::testing::AllOf(HasSubstr("cannot trust the server"), HasSubstr("self-signed"), HasSubstr("--ca")));
  ServerUrl wrong = secured.url();
  wrong.access.authorities = make_certificate(secured.folder.path(), "wrong").certificate;
  EXPECT_THAT(complaint_of(wrong), HasSubstr("cannot trust the server"));
  wrong.access.authorities = secured.folder / "nothing.pem";
  EXPECT_THAT(complaint_of(wrong), HasSubstr("nothing.pem"));
  EXPECT_THAT(complaint_of(Secured({.has_expired = true}).url()), HasSubstr("certificate has expired"));
  const Secured stranger({.for_this_machine = false});
  EXPECT_THAT(complaint_of(stranger.url()), HasSubstr("IP address mismatch"));
  EXPECT_THAT(complaint_of(stranger.url("localhost")), HasSubstr("hostname mismatch"));
}

TEST(Tls, AndWithoutItAreToldApart) {
  const Secured secured;
  ServerUrl plain = secured.url();
  plain.secure = false;
  for (const std::string& complaint : {fetch_coarse(plain).error().message, http_get(plain, "/api/datasets").error().message}) {
    EXPECT_THAT(complaint, ::testing::AllOf(HasSubstr("is not an intervale server"), HasSubstr("does it require wss://?")));
  }
  const Stranger alert(std::string("\x15\x03\x01\x00\x02\x02\x46", 7));  // as OpenSSL's server answers what is no TLS
  EXPECT_THAT(fetch_coarse(parse_url(alert.url("x")).value()).error().message, HasSubstr("does it require wss://?"));
  const Stranger page("HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nok");
  EXPECT_THAT(fetch_coarse(parse_url(page.url("x")).value()).error().message, ::testing::Not(HasSubstr("wss://")));
  const Stranger stranger("220 mail ready\r\n");
  ServerUrl secure = parse_url(stranger.url("x")).value();
  secure.secure = true;
  const auto fetched = fetch_coarse(secure);
  ASSERT_FALSE(fetched);
  EXPECT_THAT(fetched.error().message, HasSubstr("TLS handshake failed"));
  EXPECT_EQ(talk(secured.server->port(), "GET / HTTP/1.1\r\nHost: x\r\n\r\n").find("HTTP/1.1"), std::string::npos);
}

TEST(Tls, AHandshakeThatDoesNotComeIsCut) {
  ServeOptions options;
  options.handshake_time = std::chrono::milliseconds(50);
  const Secured secured({}, options);
  EXPECT_EQ(talk(secured.server->port(), ""), "");  // and returns
}

TEST(Tls, TheCertificateMayChangeWhileSessionsRun) {
  const Secured secured;
  const auto old = fetch_coarse(secured.url());
  ASSERT_TRUE(old) << old.error().message;
  const auto before = secured.folder.file("before.pem", contents_of(secured.files.certificate));
  (void)make_certificate(secured.folder.path(), "server");
  ServerUrl trusts_old = secured.url(), trusts_new = secured.url();
  trusts_old.access.authorities = before;
  EXPECT_TRUE(fetch_coarse(trusts_old)) << "nobody looked yet";
  secured.server->reload();
  EXPECT_FALSE(fetch_coarse(trusts_old));
  EXPECT_TRUE(fetch_coarse(trusts_new));
  secured.folder.file("server.key", "half a key");
  secured.server->reload();
  EXPECT_TRUE(fetch_coarse(trusts_new)) << "what cannot be read changes nothing";
}

TEST(Tls, FilesThatDoNotDoAreAnError) {
  const TempDir folder;
  const auto one = make_certificate(folder.path(), "one");
  const auto other = make_certificate(folder.path(), "other");
  for (const TlsFiles& files : {TlsFiles{one.certificate, other.key}, TlsFiles{folder / "nothing", one.key},
                                TlsFiles{one.certificate, folder / "nothing"}, TlsFiles{one.key, one.key}}) {
    ServeOptions options;
    options.listen = "127.0.0.1:0";
    options.tls = files;
    EXPECT_FALSE(Server::start(options));
  }
}

TEST(Tls, IsWhatProgramsSpeakIfTold) {
  const TempDir folder;
  const auto files = make_certificate(folder.path(), "server");
  ServerProgram server(buckyball().string(), {"--tls-cert", files.certificate, "--tls-key", files.key, "--tokens", folder.file("tokens", "hush\n")});
  const std::string url = "wss://127.0.0.1:" + std::to_string(server.port());
  const std::vector<std::string> access{"--ca", files.certificate, "--token", "hush"};
  const auto with_access = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), access.begin(), access.end());
    return run(arguments);
  };
  EXPECT_THAT(with_access({program("intervale-client"), "list", url}).out, HasSubstr("buckyball: "));
  EXPECT_EQ(with_access({program("intervale-client"), "fetch", url + "/buckyball"}).status, 0);
  const auto loaded =
      with_access({program("intervale-load"), url + "/buckyball", "--clients", "3", "--duration", "20", "--scenario", "full", "--verify", "--json"});
  EXPECT_EQ(loaded.status, 0) << loaded.err;
  EXPECT_EQ(nlohmann::json::parse(loaded.out, nullptr, false).at("verified"), 3);
  const auto distrusted = run({program("intervale-load"), url + "/buckyball", "--clients", "3", "--duration", "1"});
  EXPECT_EQ(distrusted.status, 1);
  EXPECT_THAT(distrusted.err, HasSubstr("cannot trust the server"));
  EXPECT_EQ(run({program("intervale"), "serve", buckyball(), "--tls-cert", files.certificate}).status, 2);
}

}  // namespace
}  // namespace intervale
