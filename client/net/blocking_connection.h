// Blocking connections to a server. Internal to client/net and client/load: brings in Asio.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/error.hpp>
#include <chrono>
#include <memory>
#include <string>

#include "client/net/url.h"
#include "common/util/result.h"
#include "protocol/transport/stream.h"

namespace intervale {

// An io_context that runs one asynchronous operation at a time, to its end.
class BlockingRun {
 public:
  using Error = boost::system::error_code;
  [[nodiscard]] boost::asio::io_context& io() { return io_; }

  // start(done) starts an operation that has a deadline of its own. done is its handler; the first argument is the
  // error.
  template <class Start>
  Error operator()(Start start) {
    Error result;
    bool done = false;
    start([&](Error error, auto&&...) {
      result = error;
      done = true;
    });
    if (io_.stopped()) io_.restart();
    while (!done && io_.run_one() != 0) {
    }
    return result;
  }

  // For an operation without a deadline: if it takes longer, closes the stream and returns beast::error::timeout.
  template <class Start>
  Error within(std::chrono::milliseconds time, Stream& stream, Start start) {
    boost::asio::steady_timer timer(io_, time);
    bool late = false;
    timer.async_wait([&](Error error) {
      if (error) return;
      late = true;
      stream.close();
    });
    const Error error = (*this)(start);
    timer.cancel();
    io_.poll();  // the handler of the timer refers to this call
    return late ? Error(boost::beast::error::timeout) : error;
  }

 private:
  boost::asio::io_context io_{1};
};

// Resolves the host, connects and, for wss://, does the TLS handshake: within kConnectTime each.
[[nodiscard]] Result<void> connect(BlockingRun& run, Stream& stream, const ServerUrl& url);

// The TLS context for a URL; nullptr for ws://.
[[nodiscard]] Result<std::shared_ptr<const TlsContext>> tls_for(const ServerUrl& url);

// The text for a failed TLS handshake: why the certificate was refused, if that is the reason; else the error.
[[nodiscard]] std::string tls_failure(const Stream& stream, const ServerUrl& url, const boost::system::error_code& error);

// The text for a failed HTTP request. It asks for wss:// if the server seems to require TLS.
[[nodiscard]] std::string http_failure(const ServerUrl& url, const boost::system::error_code& error);

}  // namespace intervale
