// A connection to a server, for those that block. Internal to client/net: brings in Asio.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/error.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "client/net/url.h"
#include "common/util/result.h"
#include "protocol/transport/stream.h"

namespace intervale {

// An io_context that one operation at a time is run on, to its end.
class BlockingRun {
 public:
  using Error = boost::system::error_code;
  [[nodiscard]] boost::asio::io_context& io() { return io_; }

  // start(done) starts it, with a handler whose first argument is the error. The operation has a deadline of its own.
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

  // One that has none: the stream is cut if it takes longer, and the error is beast::error::timeout.
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
    io_.poll();  // what the timer still says refers to this call
    return late ? Error(boost::beast::error::timeout) : error;
  }

 private:
  boost::asio::io_context io_{1};
};

// Resolves, connects and, where the URL says so, shakes hands for TLS: within kConnectTime each.
[[nodiscard]] Result<void> connect(BlockingRun& run, Stream& stream, const ServerUrl& url);

// What a client of that URL needs; nullptr without TLS.
[[nodiscard]] Result<std::shared_ptr<const TlsContext>> tls_for(const ServerUrl& url);

// "…: certificate has expired; …", if that is what went wrong, or else the error.
[[nodiscard]] std::string tls_failure(const Stream& stream, const ServerUrl& url, const boost::system::error_code& error);

// "…: is not an intervale server: end of stream; …": what went wrong with an HTTP request, and whether it looks as if TLS was wanted.
[[nodiscard]] std::string http_failure(const ServerUrl& url, const boost::system::error_code& error);

}  // namespace intervale
