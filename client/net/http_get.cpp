#include "client/net/http_get.h"

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <utility>

#include "client/net/blocking_connection.h"
#include "client/net/connection.h"
#include "protocol/messages.h"

namespace intervale {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::chrono::seconds kAnswerTime{10};
constexpr std::size_t kMaxBody = 16 << 20;

}  // namespace

Result<std::string> http_get(const ServerUrl& url, const std::string& target) {
  BlockingRun run;
  Stream stream(run.io());
  if (auto connected = connect(run, stream, url); !connected) return tl::unexpected(connected.error());

  http::request<http::empty_body> request(http::verb::get, target, 11);
  request.set(http::field::host, url.authority());
  request.set(http::field::user_agent, "intervale-client/" INTERVALE_VERSION);
  request.set(http::field::connection, "close");
  if (url.access.token) request.set(http::field::authorization, "Bearer " + *url.access.token);
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMaxBody);
  beast::flat_buffer buffer;
  auto error = run.within(kAnswerTime, stream, [&](auto done) { http::async_write(stream, request, done); });
  if (!error) error = run.within(kAnswerTime, stream, [&](auto done) { http::async_read(stream, buffer, parser, done); });
  if (error == beast::error::timeout) return fail("no answer from " + url.authority() + " within 10 s: is it an intervale server?");
  if (error) return fail(http_failure(url, error));
  if (!parser.get()[http::field::server].starts_with(protocol::kServerName)) return fail(url.authority() + " is not an intervale server");
  if (parser.get().result() == http::status::unauthorized) return tl::unexpected(unauthorized(url));
  if (parser.get().result() != http::status::ok) {
    return fail("the server at " + url.authority() + " answered " + std::to_string(parser.get().result_int()) + " for " + target);
  }
  return std::move(parser.get().body());
}

}  // namespace intervale
