// What Beast speaks HTTP and WebSocket over: TCP, or TLS over TCP, chosen when running. Brings in Asio.
//
// Beast's own way, a template for either, would compile all that is above it twice, a minute more. Here it is compiled once: plain TCP goes straight
// to the socket, and TLS through a call whose handler's type is forgotten, which is nothing beside enciphering.
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

// One thread at a time. Beast's AsyncStream. A moved-from one can be closed and destroyed.
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

  // From here on TLS is spoken, from the handshake on. See make_tls.
  void use_tls(std::shared_ptr<const TlsContext> context, const std::string& host = {}) { tls_ = make_tls(*socket_, std::move(context), host); }

  // Cuts it. What is under way fails.
  void close() {
    Error ignored;
    if (socket_) socket_->close(ignored);
  }

  // void(Error). Done at once without TLS.
  template <class Token>
  auto async_handshake(Token&& token) {
    return boost::asio::async_initiate<Token, void(Error)>([this](auto handler) { this->tls_or_nothing(std::move(handler), &Tls::handshake); },
                                                           token);
  }

  // Says good-bye within TLS, and waits for the answer. void(Error). Done at once without TLS.
  template <class Token>
  auto async_shutdown(Token&& token) {
    return boost::asio::async_initiate<Token, void(Error)>([this](auto handler) { this->tls_or_nothing(std::move(handler), &Tls::shutdown); }, token);
  }

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(Error, std::size_t)>(
        [this](auto handler, const Buffers& into) {
          if (!tls_) return socket_->async_read_some(into, std::move(handler));
          tls_->read_some(first_of(into), forget_type(std::move(handler)));
        },
        token, buffers);
  }

  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(Error, std::size_t)>(
        [this](auto handler, const Buffers& from) {
          if (!tls_) return socket_->async_write_some(from, std::move(handler));
          // One record, however many pieces it is in.
          tls_->write_some(boost::asio::buffer_copy(tls_->room(), from), forget_type(std::move(handler)));
        },
        token, buffers);
  }

 private:
  template <class Handler>
  auto forget_type(Handler handler) {
    return [shared = std::make_shared<Handler>(std::move(handler)), executor = get_executor()](Error error, auto... more) {
      boost::asio::dispatch(boost::asio::get_associated_executor(*shared, executor),
                            [shared, error, more...] { std::move (*shared)(error, more...); });
    };
  }

  template <class Handler>
  void tls_or_nothing(Handler handler, void (Tls::*act)(Tls::Done)) {
    if (tls_) return ((*tls_).*act)(forget_type(std::move(handler)));
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

  std::unique_ptr<Socket> socket_;  // where it stays, for TLS refers to it
  std::unique_ptr<Tls> tls_;
};

// How Beast's WebSocket ends a stream: at once, and in order.
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
