// The stream beneath HTTP and WebSocket: TCP, or TLS over TCP, chosen at run time. Includes Asio.
//
// Beast's usual way, a template over the stream type, would compile everything above it twice, which takes a minute
// more. Here plain TCP calls the socket directly, and TLS goes through a type-erased handler, whose cost is small
// beside encryption.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <memory>
#include <string>
#include <utility>

#include "protocol/transport/tls.h"

namespace intervale {

// A model of Beast's AsyncStream. One thread at a time. A moved-from stream can be closed and destroyed.
class Stream {
 public:
  using executor_type = boost::asio::any_io_executor;
  using Socket = boost::asio::ip::tcp::socket;
  using Error = boost::system::error_code;

  explicit Stream(Socket socket) : socket_(std::make_unique<Socket>(std::move(socket))) {}
  explicit Stream(const executor_type& executor) : Stream(Socket(executor)) {}
  explicit Stream(boost::asio::io_context& io) : Stream(Socket(io)) {}

  executor_type get_executor() { return socket_->get_executor(); }
  Socket& socket() { return *socket_; }
  [[nodiscard]] const Tls* tls() const { return tls_.get(); }

  // Use TLS from now on, beginning with async_handshake(). See make_tls().
  void use_tls(std::shared_ptr<const TlsContext> context, const std::string& host = {}) { tls_ = make_tls(*socket_, std::move(context), host); }

  // Closes the socket. Pending operations fail.
  void close() {
    Error ignored;
    if (socket_) socket_->close(ignored);
  }

  // Completes with void(Error); at once without TLS.
  template <class Token>
  auto async_handshake(Token&& token) {
    return boost::asio::async_initiate<Token, void(Error)>([this](auto handler) { this->run_with_tls(std::move(handler), &Tls::handshake); }, token);
  }

  // Sends the TLS close_notify, and waits for the peer's. Completes with void(Error); at once without TLS.
  template <class Token>
  auto async_shutdown(Token&& token) {
    return boost::asio::async_initiate<Token, void(Error)>([this](auto handler) { this->run_with_tls(std::move(handler), &Tls::shutdown); }, token);
  }

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(Error, std::size_t)>(
        [this](auto handler, const Buffers& into) {
          if (!tls_) return socket_->async_read_some(into, std::move(handler));
          tls_->read_some(first_of(into), erase_type(std::move(handler)));
        },
        token, buffers);
  }

  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(Error, std::size_t)>(
        [this](auto handler, const Buffers& from) {
          if (!tls_) return socket_->async_write_some(from, std::move(handler));
          // All buffers in one TLS record.
          tls_->write_some(boost::asio::buffer_copy(tls_->write_buffer(), from), erase_type(std::move(handler)));
        },
        token, buffers);
  }

 private:
  template <class Handler>
  auto erase_type(Handler handler) {
    return [shared = std::make_shared<Handler>(std::move(handler)), executor = get_executor()](Error error, auto... more) {
      boost::asio::dispatch(boost::asio::get_associated_executor(*shared, executor),
                            [shared, error, more...] { std::move (*shared)(error, more...); });
    };
  }

  template <class Handler>
  void run_with_tls(Handler handler, void (Tls::*act)(Tls::Done)) {
    if (tls_) return ((*tls_).*act)(erase_type(std::move(handler)));
    auto executor = boost::asio::get_associated_executor(handler, get_executor());
    boost::asio::post(executor, [done = std::move(handler)]() mutable { std::move(done)(Error()); });
  }

  template <class Buffers>
  static boost::asio::mutable_buffer first_of(const Buffers& buffers) {
    for (auto at = boost::asio::buffer_sequence_begin(buffers); at != boost::asio::buffer_sequence_end(buffers); ++at) {
      const boost::asio::mutable_buffer buffer = *at;
      if (buffer.size() > 0) return buffer;
    }
    return {};
  }

  std::unique_ptr<Socket> socket_;  // on the heap: TLS refers to it, also after a move
  std::unique_ptr<Tls> tls_;
};

// Beast's WebSocket calls these to close the stream: at once, or in order.
inline void beast_close_socket(Stream& stream) { stream.close(); }

inline void teardown(boost::beast::role_type role, Stream& stream, boost::system::error_code& error) {
  boost::beast::websocket::teardown(role, stream.socket(), error);
}

template <class Handler>
void async_teardown(boost::beast::role_type role, Stream& stream, Handler&& handler) {
  if (stream.tls() == nullptr) return boost::beast::websocket::async_teardown(role, stream.socket(), std::forward<Handler>(handler));
  stream.async_shutdown(std::forward<Handler>(handler));
}

}  // namespace intervale
