#include "client/load/load_connection.h"

#include <boost/asio/connect.hpp>

#include "client/core/backoff.h"
#include "client/net/blocking_connection.h"
#include "client/net/connection.h"
#include "protocol/messages.h"
#include "protocol/transport/await.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

}  // namespace

LoadConnection::LoadConnection(asio::io_context& io, const Endpoints& endpoints, const LoadPlan& plan, std::uint64_t seed)
    : io_(io), endpoints_(endpoints), plan_(plan), seed_(seed), websocket_(std::in_place, io), pause_(io) {}

asio::awaitable<bool> LoadConnection::open() {
  auto& stream = beast::get_lowest_layer(*websocket_);
  // Until the WebSocket's own deadlines hold.
  asio::steady_timer deadline(io_, plan_.patience);
  deadline.async_wait([&stream](beast::error_code error) {
    if (!error) stream.close();
  });
  if (const auto [error, endpoint] = co_await asio::async_connect(stream.socket(), endpoints_, kAwait); error) {
    complaint_ = "cannot connect to " + plan_.url.authority() + ": " + error.message();
    co_return false;
  }
  beast::error_code ignored;
  stream.socket().set_option(asio::ip::tcp::no_delay(true), ignored);
  if (plan_.tls) {
    stream.use_tls(plan_.tls, plan_.url.host);
    if (const auto [error] = co_await stream.async_handshake(kAwait); error) {
      complaint_ = tls_failure(stream, plan_.url, error);
      co_return false;
    }
  }
  deadline.cancel();
  websocket_->set_option(websocket::stream_base::timeout{plan_.patience, kSilenceTime, true});
  websocket_->set_option(websocket::stream_base::decorator([this](websocket::request_type& request) {
    if (plan_.url.access.token) request.set(http::field::authorization, "Bearer " + *plan_.url.access.token);
    request.set(http::field::user_agent, "intervale-load/" INTERVALE_VERSION);
    request.set(http::field::sec_websocket_protocol, protocol::kSubprotocol);
  }));
  websocket_->read_message_max(protocol::kMaxServerMessage);
  websocket_->auto_fragment(false);
  websocket_->binary(true);
  websocket::response_type response;
  const std::string host = plan_.url.authority();
  if (const auto [error] = co_await websocket_->async_handshake(response, host, protocol::kPath, kAwait); error) {
    const bool away = error == websocket::error::upgrade_declined && response.result() == http::status::service_unavailable;
    complaint_ = away ? turned_away(plan_.url, response.body()).message : "no WebSocket to " + host + ": " + error.message();
    co_return false;
  }
  co_return true;
}

asio::awaitable<bool> LoadConnection::open_again() {
  const auto deadline = LoadClock::now() + *plan_.reconnect;
  const std::string why = complaint_;
  Backoff backoff(seed_);
  while (!given_up_) {
    const auto next = LoadClock::now() + backoff.next();
    if (next > deadline) {
      complaint_ = why;
      break;
    }
    pause_.expires_at(next);
    co_await pause_.async_wait(kAwait);
    if (given_up_) break;
    websocket_.emplace(io_);
    if (co_await open()) co_return true;
  }
  co_return false;
}

void LoadConnection::lose(const std::string& why) {
  complaint_ = why;
  cut();
}

void LoadConnection::cut() { beast::get_lowest_layer(*websocket_).close(); }

void LoadConnection::give_up() {
  given_up_ = true;
  cut();
  pause_.cancel();
}

}  // namespace intervale
