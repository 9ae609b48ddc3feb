#include "tests/e2e/support/peers.h"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <thread>
#include <utility>

namespace intervale {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using Error = boost::system::error_code;

const tcp::endpoint kAnyPort(asio::ip::address_v4::loopback(), 0);

std::string url_of(const tcp::acceptor& acceptor, const std::string& name) {
  return "ws://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()) + "/" + name;
}

// Blocking calls are ended from another thread by shutting the socket down.
void shut(tcp::socket& socket) {
  Error ignored;
  socket.shutdown(tcp::socket::shutdown_both, ignored);
}
void shut(tcp::acceptor& acceptor) { ::shutdown(acceptor.native_handle(), SHUT_RDWR); }

void pass_on(tcp::socket& from, tcp::socket& to, const std::function<bool(std::uint64_t)>& on_bytes) {
  std::array<char, 4096> bytes{};
  std::uint64_t total = 0;
  for (;;) {
    Error error;
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
  tcp::socket client{io};
  tcp::socket server{io};
  std::thread thread;
};

Relay::Relay(std::uint16_t port, std::function<bool(std::uint64_t)> on_bytes) : state_(std::make_unique<State>()) {
  state_->thread = std::thread([&state = *state_, port, on_bytes = std::move(on_bytes)] {
    Error error;
    state.acceptor.accept(state.client, error);
    if (!error) state.server.connect({asio::ip::address_v4::loopback(), port}, error);
    if (error) return;
    std::thread upstream([&state] { pass_on(state.client, state.server, [](std::uint64_t) { return true; }); });
    pass_on(state.server, state.client, on_bytes);
    upstream.join();
  });
}

Relay::~Relay() {
  shut(state_->acceptor);
  shut(state_->client);
  shut(state_->server);
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
    Error error;
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

}  // namespace intervale
