#include "tests/hostile/hostile_connection.h"

#include <boost/asio/write.hpp>
#include <utility>

#include "protocol/codec.h"
#include "protocol/transport/await.h"

namespace intervale {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;

asio::awaitable<bool> HostileConnection::connect(const tcp::endpoint& server, const asio::ip::address_v4& source) {
  auto& socket = ws_.next_layer();
  beast::error_code failure;
  socket.open(tcp::v4(), failure);
  if (!failure) socket.bind({source, 0}, failure);
  if (failure) {
    end("no socket");
    co_return false;
  }
  if (const auto [error] = co_await socket.async_connect(server, kAwait); error) {
    end("not connected");
    co_return false;
  }
  ++tally_.connections;
  beast::error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  co_return true;
}

asio::awaitable<bool> HostileConnection::upgrade() {
  ws_.set_option(websocket::stream_base::decorator(
      [](websocket::request_type& request) { request.set(beast::http::field::sec_websocket_protocol, protocol::kSubprotocol); }));
  ws_.read_message_max(protocol::kMaxServerMessage);
  ws_.auto_fragment(false);
  ws_.binary(true);
  websocket::response_type response;
  if (const auto [error] = co_await ws_.async_handshake(response, "127.0.0.1", protocol::kPath, kAwait); error) {
    end(error == websocket::error::upgrade_declined ? std::to_string(response.result_int()) : "cut");
    co_return false;
  }
  ++tally_.sessions;
  co_return true;
}

asio::awaitable<bool> HostileConnection::send(const protocol::ClientMessage& message) {
  const auto bytes = protocol::encode(message);
  co_return co_await send_bytes(bytes);
}

// A failure is counted by the reader, which learns the close code.
asio::awaitable<bool> HostileConnection::send_bytes(std::span<const std::uint8_t> message) {
  if (has_ended_) co_return false;
  const auto [error, size] = co_await ws_.async_write(asio::buffer(message.data(), message.size()), kAwait);
  if (!error) ++tally_.messages;
  co_return !error;
}

asio::awaitable<bool> HostileConnection::send_fragment(std::uint8_t byte) {
  if (has_ended_) co_return false;
  const auto [error, size] = co_await ws_.async_write_some(false, asio::buffer(&byte, 1), kAwait);
  co_return !error;
}

asio::awaitable<bool> HostileConnection::send_raw(const std::string& text) {
  if (has_ended_) co_return false;
  const auto [error, size] = co_await asio::async_write(ws_.next_layer(), asio::buffer(text), kAwait);
  co_return !error;
}

asio::awaitable<bool> HostileConnection::send_credit() {
  if (spent_ == 0) co_return !has_ended_;
  const protocol::ClientMessage credit = protocol::Credit{std::exchange(spent_, 0)};
  co_return co_await send(credit);
}

asio::awaitable<std::optional<protocol::ServerMessage>> HostileConnection::receive() {
  if (has_ended_) co_return std::nullopt;
  buffer_.clear();
  if (const auto [error, size] = co_await ws_.async_read(buffer_, kAwait); error) {
    end(error == websocket::error::closed ? std::to_string(ws_.reason().code) : "cut");
    co_return std::nullopt;
  }
  auto message = protocol::decode_server_message({static_cast<const std::uint8_t*>(buffer_.data().data()), buffer_.size()});
  if (!message) {
    end("not understood");
    co_return std::nullopt;
  }
  if (const auto* batch = std::get_if<protocol::Batch>(&*message)) {
    spent_ += protocol::cost_of(*batch);
    ++tally_.answers;
  }
  if (std::holds_alternative<protocol::Done>(*message)) ++tally_.answers;
  co_return std::move(*message);
}

asio::awaitable<bool> HostileConnection::receive_answer(std::uint64_t epoch, Until until) {
  for (bool is_answered = false; !is_answered;) {
    const auto message = co_await receive();
    if (!message) co_return false;
    const auto* batch = std::get_if<protocol::Batch>(&*message);
    const auto* done = std::get_if<protocol::Done>(&*message);
    is_answered = (until == Until::first_answer && batch && batch->epoch == epoch) || (done && done->epoch == epoch);
    if (is_answered || spent_ > protocol::kDefaultWindow / 4) (void)co_await send_credit();
  }
  co_return true;
}

asio::awaitable<void> HostileConnection::receive_all() {
  while (!has_ended_) {
    const auto message = co_await receive();  // named: g++ 12 destroys temporaries in a co_await twice
  }
}

asio::awaitable<void> HostileConnection::receive_all_raw() {
  while (!has_ended_) {
    buffer_.clear();
    const auto [error, size] = co_await ws_.next_layer().async_read_some(buffer_.prepare(1024), kAwait);
    if (error) end("cut");
  }
}

void HostileConnection::reset() {
  has_ended_ = true;
  beast::error_code ignored;
  ws_.next_layer().set_option(tcp::socket::linger(true, 0), ignored);
  ws_.next_layer().close(ignored);
}

void HostileConnection::end(const std::string& how) {
  if (std::exchange(has_ended_, true)) return;
  ++tally_.ends[how];
}

}  // namespace intervale
