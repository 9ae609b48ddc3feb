// Requests that are odd, malformed or hostile, byte by byte: what each is answered, and that nobody else notices.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale::http_cases {
namespace {

struct Case {
  std::string name, request;
  std::string answers;    // the status of each, in order; empty: the connection is closed without one
  std::string part = {};  // that the answers contain
};
using Cases = std::vector<Case>;

const std::string kEnd = "\r\n", kHost = "Host: x\r\n", kUpgrade = "Upgrade: websocket\r\n", kVersion = "Sec-WebSocket-Version: 13\r\n",
                  kKey = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n", kConnection = "Connection: Upgrade\r\n",
                  kProtocol = "Sec-WebSocket-Protocol: intervale.v1\r\n";

std::string line(const std::string& text) { return text + kEnd + kHost + kEnd; }
std::string get_of(const std::string& target) { return line("GET " + target + " HTTP/1.1"); }
std::string with(const std::string& header, const std::string& body = {}) {
  return "GET /healthz HTTP/1.1" + kEnd + kHost + header + kEnd + kEnd + body;
}
const std::string kPlain = get_of("/healthz");

Cases methods() {
  return {
      {"TRACE", line("TRACE / HTTP/1.1"), "405", "Allow: GET, HEAD\r\n"},
      {"CONNECT", line("CONNECT x:80 HTTP/1.1"), "400"},
      {"OPTIONS of all", line("OPTIONS * HTTP/1.1"), "400"},
      {"small letters", line("get /healthz HTTP/1.1"), "405"},
      {"a long one", line(std::string(1000, 'X') + " / HTTP/1.1"), "405"},
      {"with a control character", line("G\x01T / HTTP/1.1"), "400"},
      {"none", line(" / HTTP/1.1"), "400"},
      {"HTTP/2", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", "400"},
      {"a TLS handshake", std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11) + kEnd + kEnd, "400"},
  };
}

Cases targets() {
  return {
      {"above the root", get_of("/../../etc/passwd"), "404"},
      {"above the root, escaped", get_of("/%2e%2e/%2e%2e/etc/passwd"), "404"},
      {"above the list", get_of("/api/datasets/..%2f..%2fetc%2fpasswd"), "404"},
      {"a folder", get_of("/api/datasets/"), "404"},
      {"two slashes", get_of("//healthz"), "404"},
      {"an escaped letter", get_of("/%68ealthz"), "200"},
      {"an escaped slash", get_of("/%2fhealthz"), "404"},
      {"half an escape", get_of("/%"), "400"},
      {"no escape", get_of("/%zz"), "400"},
      {"an escaped NUL", get_of("/healthz%00.html"), "400"},
      {"a NUL", get_of("/healthz" + std::string(1, '\0')), "400"},
      {"a byte that is no UTF-8", get_of("/\xff"), "404"},
      {"without a slash", get_of("healthz"), "400"},
      {"none", line("GET HTTP/1.1"), "400"},
      {"of another scheme", get_of("ftp://x/healthz"), "400"},
      {"with a user", get_of("http://root@x/healthz"), "400"},
      {"with a fragment", get_of("/healthz#x"), "404"},
      {"a long query", get_of("/healthz?" + std::string(3000, '%')), "200"},
      {"longer than a header may be", get_of("/" + std::string(5000, 'a')), "431"},
  };
}

Cases versions() {
  return {
      {"0.9", "GET /healthz\r\n\r\n", "400"},
      {"1.0", "GET /healthz HTTP/1.0\r\n\r\n", "200", "HTTP/1.0 200"},
      {"1.0 answers one request", "GET /healthz HTTP/1.0\r\n\r\nGET /readyz HTTP/1.0\r\n\r\n", "200"},
      {"1.0 that stays", "GET /healthz HTTP/1.0\r\nConnection: keep-alive\r\n\r\nGET /readyz HTTP/1.0\r\n\r\n", "200 200"},
      {"1.2", line("GET /healthz HTTP/1.2"), "400"},
      {"2.0", line("GET /healthz HTTP/2.0"), "400"},
      {"9.9", line("GET /healthz HTTP/9.9"), "400"},
      {"1.10", line("GET /healthz HTTP/1.10"), "400"},
      {"of another protocol", line("GET /healthz RTSP/1.0"), "400"},
      {"in small letters", line("GET /healthz http/1.1"), "400"},
      {"two blanks", line("GET  /healthz HTTP/1.1"), "400"},
      {"lines without returns", "GET /healthz HTTP/1.1\nHost: x\n\n", "400"},
  };
}

Cases headers() {
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "A: b\r\n";
  return {
      {"without a colon", with("Accept"), "400"},
      {"a blank before the colon", with("Content-Length : 5", "hello"), "400"},
      {"without a name", with(": x"), "400"},
      {"a blank before the first", "GET /healthz HTTP/1.1\r\n Host: x\r\nHost: x\r\n\r\n", "400"},
      {"a control character", with("Accept: a\x01"), "400"},
      {"a return", with("Accept: a\rb"), "400"},
      {"a NUL", with("Accept: a" + std::string(1, '\0')), "400"},
      {"a name that is no ASCII", with("Accept\xff: a"), "400"},
      {"a value that is no ASCII", with("Accept: \xff"), "200"},
      {"many", with(many.substr(0, 3000) + "A: b"), "200"},
      {"too many", with(many + "A: b"), "431"},
      {"a huge one", with("A: " + std::string(1 << 20, 'b')), "431"},
      {"an empty host", "GET /healthz HTTP/1.1\r\nHost:\r\n\r\n", "200"},
      {"a host with a path", "GET /healthz HTTP/1.1\r\nHost: a/b\r\n\r\n", "400"},
      {"a host with a user", "GET /healthz HTTP/1.1\r\nHost: u@a\r\n\r\n", "400"},
      {"a host that ends the policy of a page", "GET / HTTP/1.1\r\nHost: a;script-src\r\n\r\n", "200", "connect-src 'self' ws: wss:;"},
      {"two hosts, in other letters", "GET /healthz HTTP/1.1\r\nHost: x\r\nhOsT: x\r\n\r\n", "400"},
  };
}

Cases bodies() {
  const std::string same = "Content-Length: 5\r\n", chunked = "Transfer-Encoding: chunked\r\n";
  return {
      {"of no bytes", with("Content-Length: 0") + kPlain, "200 200"},
      {"two lengths", with(same + "Content-Length: 6", "hello"), "400"},
      {"the same length twice", with(same + "Content-Length: 5", "hello" + kPlain), "200"},
      {"a negative length", with("Content-Length: -5", "hello"), "400"},
      {"a length with a sign", with("Content-Length: +5", "hello"), "400"},
      {"a length in hex", with("Content-Length: 0x5", "hello"), "400"},
      {"a length beyond 64 bits", with("Content-Length: 18446744073709551621", "hello"), "400"},
      {"an empty length", with("Content-Length:", "hello"), "400"},
      {"a length and chunks", with(same + "Transfer-Encoding: chunked", "0\r\n\r\n"), "400"},
      {"chunks and a length", with(chunked + "Content-Length: 5", "0\r\n\r\n"), "400"},
      {"chunks at last", with("Transfer-Encoding: gzip, chunked", "0\r\n\r\n" + kPlain), "200"},
      {"chunks not at last", with("Transfer-Encoding: chunked, gzip", "0\r\n\r\n"), "400"},
      {"an unknown coding", with("Transfer-Encoding: xchunked", "0\r\n\r\n"), "400"},
      {"an empty coding", with("Transfer-Encoding:", "0\r\n\r\n"), "400"},
      {"of a HEAD", "HEAD /healthz HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello" + kPlain, "200"},
      {"of a POST that waits", "POST /healthz HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\nExpect: 100-continue\r\n\r\n", "405"},
      {"of a POST that does not come", "POST /healthz HTTP/1.1\r\nHost: x\r\nContent-Length: 9223372036854775807\r\n\r\n", "405"},
  };
}

Cases conditions_and_connections() {
  const auto page = [](const std::string& header) { return "GET / HTTP/1.1" + kEnd + kHost + header + kEnd + kEnd; };
  const auto twice = [](const std::string& header) { return with(header) + kPlain; };
  std::string pipeline;
  for (int i = 0; i < 20; ++i) pipeline += i == 10 ? "HEAD / HTTP/1.1" + kEnd + kHost + kEnd : kPlain;
  return {
      {"a range", page("Range: bytes=0-0"), "200", "<html>viewer"},
      {"a range upside down", page("Range: bytes=5-1"), "200", "<html>viewer"},
      {"many ranges", page("Range: bytes=" + std::string(1000, '0') + "-1,0-1,0-1"), "200", "<html>viewer"},
      {"any tag", page("If-None-Match: *"), "304"},
      {"half a tag", page("If-None-Match: \""), "200"},
      {"a weak tag of nothing", page("If-None-Match: W/"), "200"},
      {"commas", page("If-None-Match: ,,,,"), "200"},
      {"a coding of no weight", page("Accept-Encoding: gzip;q=nan, *;q=1e999"), "200"},
      {"closes whatever else", twice("Connection: keep-alive, close"), "200"},
      {"closes in other letters", twice("Connection: CLOSE"), "200"},
      {"names a field of the connection", twice("Connection: Host"), "200 200"},
      {"an empty connection", twice("Connection: ,"), "200 200"},
      {"an upgrade to what is not there", twice("Connection: Upgrade\r\nUpgrade: h2c"), "200 200"},
      {"twenty at once", pipeline, "200 200 200 200 200 200 200 200 200 200 200 200 200 200 200 200 200 200 200 200"},
      {"a good one after a bad one", line("GET / HTTP/3") + kPlain, "400"},
      {"half a request", "GET /healthz HTTP/1.1\r\nHost: x\r\n", ""},
      {"nothing", "", ""},
  };
}

std::string upgrade(const std::string& header, const std::string& start = "GET /v1/stream HTTP/1.1") { return start + kEnd + kHost + header + kEnd; }

Cases upgrades() {
  const std::string rest = kUpgrade + kConnection + kVersion, good = rest + kKey + kProtocol, chat = "Sec-WebSocket-Protocol: chat\r\n";
  const auto keyed = [&](const std::string& key) { return upgrade(rest + kProtocol + "Sec-WebSocket-Key: " + key + kEnd); };
  return {
      {"as it should be", upgrade(good), "101"},
      {"after other requests", kPlain + kPlain + upgrade(good), "200 200 101"},
      {"with extensions, of which there are none", upgrade(good + "Sec-WebSocket-Extensions: permessage-deflate\r\n"), "101"},
      {"of an older version", upgrade(kUpgrade + kConnection + kKey + kProtocol + "Sec-WebSocket-Version: 8\r\n"), "426",
       "Sec-WebSocket-Version: 13\r\n"},
      {"without a version", upgrade(kUpgrade + kConnection + kKey + kProtocol), "400"},
      {"without a key", upgrade(rest + kProtocol), "400"},
      {"with two keys", upgrade(good + kKey), "400"},
      {"with a short key", keyed("abc="), "400"},
      {"with a long key", keyed("dGhlIHNhbXBsZSBub25jZSB0aGF0IGlzIGxvbmc="), "400"},
      {"with a key that is none", keyed("!!!!IHNhbXBsZSBub25jZQ=="), "400"},
      {"without a protocol", upgrade(rest + kKey), "400"},
      {"of another protocol", upgrade(rest + kKey + chat), "400"},
      {"of a protocol in other letters", upgrade(rest + kKey + "Sec-WebSocket-Protocol: Intervale.V1\r\n"), "400"},
      {"of two protocols", upgrade(rest + kKey + "Sec-WebSocket-Protocol: chat, intervale.v1\r\n"), "101",
       "Sec-WebSocket-Protocol: intervale.v1\r\n"},
      {"of two protocols in two lines", upgrade(rest + kKey + chat + kProtocol), "101", "Sec-WebSocket-Protocol: intervale.v1\r\n"},
      {"with a body", upgrade(good + "Content-Length: 5\r\n") + "hello", "400"},
      {"with chunks", upgrade(good + "Transfer-Encoding: chunked\r\n") + "0\r\n\r\n", "400"},
      {"that does not wait for the answer", upgrade(good) + std::string("\x82\x80\0\0\0\0", 6), "400"},
      {"by POST", upgrade(good, "POST /v1/stream HTTP/1.1"), "426", "Connection: Upgrade\r\n"},
      {"by HTTP/1.0", upgrade(good, "GET /v1/stream HTTP/1.0"), "426"},
      {"elsewhere", upgrade(good, "GET /v1/stream/ HTTP/1.1"), "404"},
      {"of the page", upgrade(good, "GET / HTTP/1.1"), "200"},
      {"to another protocol", upgrade("Upgrade: h2c\r\n" + kConnection + kVersion + kKey + kProtocol), "426"},
      {"without an upgrade of the connection", upgrade(kUpgrade + kVersion + kKey + kProtocol), "426"},
      {"whose connection closes", upgrade(kUpgrade + "Connection: close\r\n" + kVersion + kKey + kProtocol), "426"},
  };
}

// The statuses of answers, with blanks between them.
std::string statuses_of(const std::string& answers) {
  std::string statuses;
  for (std::size_t at = answers.find("HTTP/1."); at != std::string::npos; at = answers.find("HTTP/1.", at + 1))
    statuses += (statuses.empty() ? "" : " ") + answers.substr(at + 9, 3);
  return statuses;
}

// Of a server with a viewer, and a session that is open meanwhile.
void expect_answers(const Cases& cases) {
  const TempDir folder;
  folder.file("index.html", "<html>viewer");
  ServeOptions options;
  options.viewer = folder.path();
  const auto server = start(options);
  const std::uint64_t all = everything(server->port());
  Waiting other(server->port());
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const std::string answers = say_all(server->port(), c.request);
    EXPECT_EQ(statuses_of(answers), c.answers) << answers.substr(0, 300);
    EXPECT_NE(answers.find(c.part), std::string::npos) << answers.substr(0, 1000);
    EXPECT_EQ(statuses_of(get(server->port(), "/healthz")), "200");
  }
  EXPECT_EQ(other.finish(), all);
}

TEST(HttpCases, OfMethods) { expect_answers(methods()); }
TEST(HttpCases, OfTargets) { expect_answers(targets()); }
TEST(HttpCases, OfVersions) { expect_answers(versions()); }
TEST(HttpCases, OfHeaders) { expect_answers(headers()); }
TEST(HttpCases, OfBodies) { expect_answers(bodies()); }
TEST(HttpCases, OfConditionsAndConnections) { expect_answers(conditions_and_connections()); }
TEST(HttpCases, OfUpgrades) { expect_answers(upgrades()); }

}  // namespace
}  // namespace intervale::http_cases
