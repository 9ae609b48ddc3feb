#include "client/net/http_get.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <utility>

#include "client/net/connection.h"
#include "protocol/messages.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr std::chrono::seconds kAnswerTime{10};
constexpr std::size_t kMaxBody = 16 << 20;

}  // namespace

Result<std::string> http_get(const ServerUrl& url, const std::string& target) {
  asio::io_context io(1);
  beast::tcp_stream stream(io);
  // Asynchronous throughout, for the stream's deadlines hold for such operations only.
  const auto run = [&io](auto start) {
    beast::error_code result;
    start([&result](beast::error_code error, auto&&...) { result = error; });
    io.restart();
    io.run();
    return result;
  };

  tcp::resolver resolver(io);
  tcp::resolver::results_type endpoints;
  auto error = run([&](auto done) {
    resolver.async_resolve(url.host, url.port, [&endpoints, done](beast::error_code failure, tcp::resolver::results_type found) mutable {
      endpoints = std::move(found);
      done(failure);
    });
  });
  if (error) return fail("cannot find the host " + url.host + ": " + error.message());
  stream.expires_after(kConnectTime);
  error = run([&](auto done) { stream.async_connect(endpoints, done); });
  if (error) return fail("cannot connect to " + url.authority() + ": " + (error == beast::error::timeout ? "no answer within 5 s" : error.message()));

  http::request<http::empty_body> request(http::verb::get, target, 11);
  request.set(http::field::host, url.authority());
  request.set(http::field::user_agent, "intervale-client/" INTERVALE_VERSION);
  request.set(http::field::connection, "close");
  if (url.access.token) request.set(http::field::authorization, "Bearer " + *url.access.token);
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMaxBody);
  beast::flat_buffer buffer;
  stream.expires_after(kAnswerTime);
  error = run([&](auto done) { http::async_write(stream, request, done); });
  if (!error) error = run([&](auto done) { http::async_read(stream, buffer, parser, done); });
  if (error == beast::error::timeout) return fail("no answer from " + url.authority() + " within 10 s: is it an intervale server?");
  if (error) return fail(url.authority() + " is not an intervale server: " + error.message());
  if (!parser.get()[http::field::server].starts_with(protocol::kServerName)) return fail(url.authority() + " is not an intervale server");
  if (parser.get().result() == http::status::unauthorized) return tl::unexpected(unauthorized(url));
  if (parser.get().result() != http::status::ok) {
    return fail("the server at " + url.authority() + " answered " + std::to_string(parser.get().result_int()) + " for " + target);
  }
  return std::move(parser.get().body());
}

}  // namespace intervale
