#include "tests/support/raw_client.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <stdexcept>

#include "protocol/codec.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;

void set_headers(websocket::stream<tcp::socket>& ws, const RawClient::Hello& hello) {
  ws.set_option(websocket::stream_base::decorator([hello](websocket::request_type& request) {
    request.set(beast::http::field::sec_websocket_protocol, hello.subprotocols);
    if (!hello.authorization.empty()) request.set(beast::http::field::authorization, hello.authorization);
    if (!hello.forwarded_for.empty()) request.set("X-Forwarded-For", hello.forwarded_for);
    if (!hello.origin.empty()) request.set(beast::http::field::origin, hello.origin);
  }));
}

}  // namespace

struct RawClient::Socket {
  asio::io_context io;
  websocket::stream<tcp::socket> ws{io};
  unsigned close_code = 0;
};

RawClient::RawClient(std::uint16_t port, const Hello& hello) : socket_(std::make_unique<Socket>()) {
  auto& ws = socket_->ws;
  ws.next_layer().open(tcp::v4());
  if (hello.narrow) {  // by its segments' size the system judges how much the server may have waiting
    ws.next_layer().set_option(tcp::socket::receive_buffer_size(4096));
    ws.next_layer().set_option(asio::detail::socket_option::integer<IPPROTO_TCP, TCP_MAXSEG>(536));
  }
  ws.next_layer().connect({asio::ip::address_v4::loopback(), port});
  set_headers(ws, hello);
  ws.handshake("127.0.0.1", protocol::kPath);
}

unsigned upgrade_status(std::uint16_t port, const RawClient::Hello& hello) {
  asio::io_context io;
  websocket::stream<tcp::socket> ws(io);
  ws.next_layer().connect({asio::ip::address_v4::loopback(), port});
  set_headers(ws, hello);
  websocket::response_type response;
  beast::error_code ignored;
  ws.handshake(response, "127.0.0.1", protocol::kPath, ignored);
  return response.result_int();
}

RawClient::~RawClient() = default;

void RawClient::send(const protocol::ClientMessage& message) { send_binary(protocol::encode(message)); }

void RawClient::send_binary(std::span<const std::uint8_t> bytes, bool last) {
  beast::error_code ignored;  // a server that has closed is what a test may be about
  socket_->ws.binary(true);
  socket_->ws.write_some(last, asio::buffer(bytes.data(), bytes.size()), ignored);
}

void RawClient::send_text(const std::string& text) {
  socket_->ws.text(true);
  socket_->ws.write(asio::buffer(text));
}

void RawClient::reset() {
  auto& socket = socket_->ws.next_layer();
  socket.set_option(tcp::socket::linger(true, 0));
  socket.close();
}

std::optional<protocol::ServerMessage> RawClient::receive() {
  beast::flat_buffer buffer;
  beast::error_code error;
  socket_->ws.read(buffer, error);
  if (error) {
    if (error == websocket::error::closed) socket_->close_code = socket_->ws.reason().code;
    return {};
  }
  auto message = protocol::decode_server_message({static_cast<const std::uint8_t*>(buffer.data().data()), buffer.size()});
  if (!message) throw std::runtime_error(message.error().message);
  return *message;
}

RawClient::End RawClient::end() {
  End end;
  while (const auto message = receive()) {
    if (const auto* fault = std::get_if<protocol::Fault>(&*message)) end.fault = *fault;
  }
  end.code = socket_->close_code;
  return end;
}

std::uint64_t RawClient::stream_to_end() {
  std::uint64_t updates = 0;
  while (const auto message = receive()) {
    if (std::holds_alternative<protocol::Done>(*message)) return updates;
    if (const auto* batch = std::get_if<protocol::Batch>(&*message)) {
      updates += batch->updates;
      send(protocol::Credit{protocol::cost_of(*batch)});
    }
  }
  throw std::runtime_error("the stream broke off");
}

namespace {

std::string exchange(std::uint16_t port, const std::string& bytes, std::size_t piece, bool is_all) {
  asio::io_context io;
  tcp::socket socket(io);
  socket.connect({asio::ip::address_v4::loopback(), port});
  boost::system::error_code ignored;
  socket.set_option(tcp::no_delay(true));
  for (std::size_t sent = 0; sent < bytes.size() && !ignored; sent += piece) {
    piece = std::min(piece, bytes.size() - sent);
    asio::write(socket, asio::buffer(&bytes[sent], piece), ignored);
  }
  if (is_all) socket.shutdown(tcp::socket::shutdown_send, ignored);
  std::string answer;
  asio::read(socket, asio::dynamic_buffer(answer), ignored);
  return answer;
}

}  // namespace

std::string talk(std::uint16_t port, const std::string& bytes, std::size_t piece) { return exchange(port, bytes, piece, false); }
std::string say_all(std::uint16_t port, const std::string& bytes) { return exchange(port, bytes, std::string::npos, true); }

}  // namespace intervale
