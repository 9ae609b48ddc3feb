#include "client/net/connection.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>
#include <string>
#include <utility>

#include "client/net/blocking_connection.h"
#include "common/util/printable.h"
#include "protocol/limits.h"
#include "protocol/messages.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using protocol::CloseCode;

}  // namespace

struct StreamConnection::Socket {
  ServerUrl url;
  BlockingRun run;
  websocket::stream<Stream> ws{run.io()};
  beast::flat_buffer buffer;
  std::optional<beast::error_code> read;  // a message was read, or the attempt failed
  bool is_reading = false;                // a read is under way
  bool is_woken = false;
  bool is_lost = false;

  // Waits for the next message. False: it was woken, or the time is over.
  bool wait(ClientSession::Clock::time_point until);
  Result<void> shake_hands();
  tl::unexpected<Error> lost(beast::error_code error);
  [[nodiscard]] Error faulted(const protocol::Fault& fault, const Error& error) const;
};

Result<void> StreamConnection::Socket::shake_hands() {
  ws.set_option(websocket::stream_base::timeout{kConnectTime, kSilenceTime, true});
  ws.set_option(websocket::stream_base::decorator([this](websocket::request_type& request) {
    if (url.access.token) request.set(http::field::authorization, "Bearer " + *url.access.token);
    request.set(http::field::user_agent, "intervale-client/" INTERVALE_VERSION);
    request.set(http::field::sec_websocket_protocol, protocol::kSubprotocol);
  }));
  ws.read_message_max(protocol::kMaxServerMessage);
  ws.auto_fragment(false);
  ws.binary(true);
  websocket::response_type response;
  const auto error = run([&](auto done) { ws.async_handshake(response, url.authority(), protocol::kPath, done); });
  if (error == beast::error::timeout) return fail("no answer from " + url.authority() + " within 5 s: is it an intervale server?");
  if (error == websocket::error::upgrade_declined && response.result() == http::status::unauthorized) return tl::unexpected(unauthorized(url));
  if (error == websocket::error::upgrade_declined && response.result() == http::status::service_unavailable) {
    return tl::unexpected(turned_away(url, response.body()));
  }
  if (error) return fail(http_failure(url, error));
  if (response[http::field::sec_websocket_protocol] != protocol::kSubprotocol) {
    return fail(url.authority() + " is not an intervale server: it does not support " + protocol::kSubprotocol);
  }
  return {};
}

bool StreamConnection::Socket::wait(ClientSession::Clock::time_point until) {
  constexpr auto kForever = ClientSession::Clock::time_point::max();
  if (!is_reading) {
    is_reading = true;
    read.reset();
    buffer.clear();
    ws.async_read(buffer, [this](beast::error_code error, std::size_t /*size*/) { read = error; });
  }
  if (run.io().stopped()) run.io().restart();
  while (!read && !is_woken && (until == kForever ? run.io().run_one() : run.io().run_one_until(until)) != 0) {
  }
  is_woken = false;
  if (!read) return false;
  is_reading = false;
  return true;
}

tl::unexpected<Error> StreamConnection::Socket::lost(beast::error_code error) {
  is_lost = error != websocket::error::message_too_big;
  if (error == websocket::error::closed) {
    const auto reason = ws.reason();
    is_lost = may_reconnect(CloseCode(reason.code));
    return fail("the server at " + url.authority() + " closed the session with code " + std::to_string(reason.code));
  }
  if (error == websocket::error::message_too_big) return fail("the server at " + url.authority() + " sent a message larger than the protocol allows");
  if (error == beast::error::timeout) return fail("lost the server at " + url.authority() + ": it does not answer pings");
  return fail("lost the server at " + url.authority() + ": " + error.message());
}

// Some faults are the user's to correct: the error says how.
Error StreamConnection::Socket::faulted(const protocol::Fault& fault, const Error& error) const {
  if (fault.code == CloseCode::no_such_dataset) {
    return {"no data set '" + url.name + "' at " + url.server() + "; http" + url.server().substr(2) + "/api/datasets lists them"};
  }
  if (fault.code == CloseCode::unauthorized) return unauthorized(url);
  if (fault.code == CloseCode::forbidden) return {"the token does not grant '" + url.name + "' at " + url.server()};
  return error;
}

Error unauthorized(const ServerUrl& url) {
  if (url.access.token) return {"the server at " + url.authority() + " does not accept the token"};
  return {"the server at " + url.authority() + " requires a token"};
}

Error turned_away(const ServerUrl& url, std::string_view body) {
  constexpr std::size_t kMost = 80;
  const std::string_view why = body.substr(0, std::min(body.find_first_of("\r\n"), kMost));
  const bool is_reason = !why.empty() && why.front() != '<';
  return {"the server at " + url.authority() + " accepts no new sessions now" + (is_reason ? ": " + printable(why) : "")};
}

StreamConnection::StreamConnection(std::unique_ptr<Socket> socket) : socket_(std::move(socket)) {}
StreamConnection::StreamConnection(StreamConnection&&) noexcept = default;
StreamConnection& StreamConnection::operator=(StreamConnection&&) noexcept = default;
StreamConnection::~StreamConnection() = default;

Result<StreamConnection> StreamConnection::open(const ServerUrl& url) {
  auto socket = std::make_unique<Socket>();
  socket->url = url;
  if (auto connected = connect(socket->run, socket->ws.next_layer(), url); !connected) return tl::unexpected(connected.error());
  if (auto greeted = socket->shake_hands(); !greeted) return tl::unexpected(greeted.error());
  return StreamConnection(std::move(socket));
}

Result<void> StreamConnection::send(ClientSession& session) {
  for (const auto& message : session.take_messages()) {
    const auto error = socket_->run([&](auto done) { socket_->ws.async_write(boost::asio::buffer(message), done); });
    if (error) return socket_->lost(error);
  }
  return {};
}

Result<ClientSession::Event> StreamConnection::receive(ClientSession& session, ClientSession::Clock::time_point until) {
  Socket& socket = *socket_;
  if (!socket.wait(until)) return ClientSession::Event{};
  if (*socket.read) return socket.lost(*socket.read);
  if (socket.ws.got_text()) return fail("the server at " + socket.url.authority() + " sent a text message; all messages are binary");
  auto event = session.receive({static_cast<const std::uint8_t*>(socket.buffer.data().data()), socket.buffer.size()}, ClientSession::Clock::now());
  if (!event && session.fault()) {
    socket.is_lost = may_reconnect(session.fault()->code);
    return tl::unexpected(socket.faulted(*session.fault(), event.error()));
  }
  if (!event) return event;
  if (auto sent = send(session); !sent) return tl::unexpected(sent.error());
  return event;
}

void StreamConnection::wake() {
  asio::post(socket_->run.io(), [socket = socket_.get()] { socket->is_woken = true; });
}

void StreamConnection::close() {
  socket_->run([this](auto done) { socket_->ws.async_close(websocket::close_code::normal, done); });
}

bool StreamConnection::is_lost() const { return socket_->is_lost; }

}  // namespace intervale
