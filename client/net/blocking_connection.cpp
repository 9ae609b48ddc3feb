#include "client/net/blocking_connection.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/error.hpp>

#include "client/net/connection.h"

namespace intervale {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

}  // namespace

Result<std::shared_ptr<const TlsContext>> tls_for(const ServerUrl& url) {
  if (!url.secure) return nullptr;
  return TlsContext::client(url.access.authorities);
}

std::string tls_failure(const Stream& stream, const ServerUrl& url, const error_code& error) {
  const std::string who = "cannot trust the server at " + url.authority() + ": ";
  if (const std::string why = stream.tls()->verify_error(); !why.empty()) return who + why + "; --ca FILE names certificates to trust";
  return "TLS handshake failed with " + url.authority() + ": " + error.message() + "; is it a server without TLS (ws://)?";
}

std::string http_failure(const ServerUrl& url, const error_code& error) {
  using boost::beast::http::error::bad_version, boost::beast::http::error::end_of_stream, boost::beast::http::error::partial_message;
  // A server with TLS ends the connection, perhaps after a few bytes that are not HTTP.
  const bool no_http = error == end_of_stream || error == partial_message || error == bad_version || error == boost::asio::error::connection_reset;
  return url.authority() + " is not an intervale server: " + error.message() + (no_http && !url.secure ? "; does it require wss://?" : "");
}

Result<void> connect(BlockingRun& run, Stream& stream, const ServerUrl& url) {
  auto tls = tls_for(url);
  if (!tls) return tl::unexpected(tls.error());
  tcp::resolver resolver(run.io());
  tcp::resolver::results_type endpoints;
  error_code error = run([&](auto done) {
    resolver.async_resolve(url.host, url.port, [&endpoints, done](error_code failure, tcp::resolver::results_type found) mutable {
      endpoints = std::move(found);
      done(failure);
    });
  });
  if (error) return fail("cannot find the host " + url.host + ": " + error.message());
  error = run.within(kConnectTime, stream, [&](auto done) { boost::asio::async_connect(stream.socket(), endpoints, done); });
  if (error == boost::beast::error::timeout) return fail("cannot connect to " + url.authority() + ": no answer within 5 s");
  if (error) return fail("cannot connect to " + url.authority() + ": " + error.message());
  stream.socket().set_option(tcp::no_delay(true), error);
  if (!*tls) return {};
  stream.use_tls(std::move(*tls), url.host);
  error = run.within(kConnectTime, stream, [&](auto done) { stream.async_handshake(done); });
  if (error == boost::beast::error::timeout) return fail("no answer from " + url.authority() + " within 5 s: is it an intervale server with TLS?");
  if (error) return fail(tls_failure(stream, url, error));
  return {};
}

}  // namespace intervale
