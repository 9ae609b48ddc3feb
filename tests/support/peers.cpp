#include "tests/support/peers.h"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "protocol/codec.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

const tcp::endpoint kAnyPort(asio::ip::address_v4::loopback(), 0);

std::string url_of(const tcp::acceptor& acceptor, const std::string& name) {
  return "ws://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()) + "/" + name;
}

// Blocking calls are ended from another thread by shutting the socket down.
void shut(tcp::socket& socket) {
  boost::system::error_code ignored;
  socket.shutdown(tcp::socket::shutdown_both, ignored);
}
void shut(tcp::acceptor& acceptor) { ::shutdown(acceptor.native_handle(), SHUT_RDWR); }

void pass_on(tcp::socket& from, tcp::socket& to, const std::function<bool(std::uint64_t)>& on_bytes) {
  std::array<char, 4096> bytes{};
  std::uint64_t total = 0;
  for (;;) {
    boost::system::error_code error;
    const std::size_t size = from.read_some(asio::buffer(bytes), error);
    total += size;
    if (error || !on_bytes(total)) break;
    asio::write(to, asio::buffer(bytes, size), error);
    if (error) break;
  }
  shut(from);
  shut(to);
}

}  // namespace

struct Relay::State {
  asio::io_context io;
  tcp::acceptor acceptor{io, kAnyPort};
  std::mutex mutex;
  bool ended = false;                         // guarded
  std::optional<tcp::socket> client, server;  // set and cleared under the mutex, used by one connection's threads
  std::thread thread;

  void pass_one_on(std::uint16_t port, const std::function<bool(std::uint64_t)>& on_bytes) {
    boost::system::error_code error;
    tcp::socket accepted(io), connected(io);
    acceptor.accept(accepted, error);
    if (!error) connected.connect({asio::ip::address_v4::loopback(), port}, error);
    if (error) return;
    {
      const std::lock_guard lock(mutex);
      if (ended) return;
      client.emplace(std::move(accepted));
      server.emplace(std::move(connected));
    }
    std::thread upstream([this] { pass_on(*client, *server, [](std::uint64_t) { return true; }); });
    pass_on(*server, *client, on_bytes);
    upstream.join();
    const std::lock_guard lock(mutex);
    client.reset();
    server.reset();
  }
  [[nodiscard]] bool has_ended() {
    const std::lock_guard lock(mutex);
    return ended;
  }
};

Relay::Relay(std::uint16_t port, std::function<bool(std::uint64_t)> on_bytes) : state_(std::make_unique<State>()) {
  state_->thread = std::thread([&state = *state_, port, on_bytes = std::move(on_bytes)] {
    while (!state.has_ended()) state.pass_one_on(port, on_bytes);
  });
}

Relay::~Relay() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ended = true;
    shut(state_->acceptor);
    if (state_->client) shut(*state_->client);
    if (state_->server) shut(*state_->server);
  }
  state_->thread.join();
}

std::string Relay::url(const std::string& name) const { return url_of(state_->acceptor, name); }

struct Stranger::State {
  asio::io_context io;
  tcp::acceptor acceptor{io, kAnyPort};
  std::thread thread;
};

Stranger::Stranger(std::string answer) : state_(std::make_unique<State>()) {
  state_->thread = std::thread([&state = *state_, answer = std::move(answer)] {
    boost::system::error_code error;
    tcp::socket socket(state.io);
    state.acceptor.accept(socket, error);
    std::array<char, 4096> bytes{};
    if (!error) socket.read_some(asio::buffer(bytes), error);
    if (!error && !answer.empty()) asio::write(socket, asio::buffer(answer), error);
    while (!error && answer.empty()) socket.read_some(asio::buffer(bytes), error);  // until the other side gives up
  });
}

Stranger::~Stranger() {
  shut(state_->acceptor);
  state_->thread.join();
}

std::string Stranger::url(const std::string& name) const { return url_of(state_->acceptor, name); }

namespace {

namespace websocket = boost::beast::websocket;

// WebSocket sessions, one after the other.
struct Sessions {
  asio::io_context io;
  tcp::acceptor acceptor{io, kAnyPort};
  std::thread thread;

  // answer: the first message of each.
  explicit Sessions(const std::function<void(websocket::stream<tcp::socket>&)>& answer)
      : thread([this, answer] {
          for (;;) {
            boost::system::error_code error;
            tcp::socket socket(io);
            acceptor.accept(socket, error);
            if (error) return;
            begin(std::move(socket), answer);
          }
        }) {}
  Sessions(const Sessions&) = delete;
  Sessions& operator=(const Sessions&) = delete;
  ~Sessions() {
    shut(acceptor);
    thread.join();
  }

  static void begin(tcp::socket socket, const std::function<void(websocket::stream<tcp::socket>&)>& answer) {
    boost::system::error_code error;
    websocket::stream<tcp::socket> ws(std::move(socket));
    ws.set_option(websocket::stream_base::decorator(
        [](websocket::response_type& response) { response.set(boost::beast::http::field::sec_websocket_protocol, protocol::kSubprotocol); }));
    ws.accept(error);
    boost::beast::flat_buffer message;
    if (!error) ws.read(message, error);
    if (!error) answer(ws);
  }
};

void say(websocket::stream<tcp::socket>& ws, const Speaker::Frame& frame, boost::system::error_code& error) {
  using Kind = Speaker::Frame::Kind;
  if (frame.kind == Kind::ping) return ws.ping(websocket::ping_data(frame.bytes), error);
  if (frame.kind == Kind::raw) {
    asio::write(ws.next_layer(), asio::buffer(frame.bytes), error);
    return;
  }
  ws.text(frame.kind == Kind::text);
  ws.write(asio::buffer(frame.bytes), error);
}

}  // namespace

struct Refuser::State : Sessions {
  using Sessions::Sessions;
};

Refuser::Refuser(protocol::CloseCode code, std::string text)
    : state_(std::make_unique<State>([fault = protocol::Fault{code, std::move(text)}](auto& ws) {
        boost::system::error_code error;
        ws.binary(true);
        ws.write(asio::buffer(protocol::encode(protocol::ServerMessage(fault))), error);
        if (!error) ws.close(websocket::close_reason(static_cast<websocket::close_code>(fault.code), fault.text), error);
      })) {}
Refuser::~Refuser() = default;
std::string Refuser::url(const std::string& name) const { return url_of(state_->acceptor, name); }

struct Speaker::State : Sessions {
  using Sessions::Sessions;
};

Speaker::Speaker(std::vector<Frame> frames, unsigned close_code)
    : state_(std::make_unique<State>([frames = std::move(frames), close_code](auto& ws) {
        boost::system::error_code error;
        for (const Frame& frame : frames) {
          for (unsigned i = 0; i < frame.times && !error; ++i) say(ws, frame, error);
        }
        if (!error && close_code != 0) ws.close(websocket::close_reason(static_cast<websocket::close_code>(close_code)), error);
      })) {}
Speaker::~Speaker() = default;
std::string Speaker::url(const std::string& name) const { return url_of(state_->acceptor, name); }

}  // namespace intervale
