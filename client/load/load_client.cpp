#include "client/load/load_client.h"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <utility>
#include <variant>

#include "common/util/printable.h"
#include "protocol/codec.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using protocol::CloseCode;

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);

CameraPath path_of(const LoadPlan& plan, unsigned client) {
  CameraPath path = plan.path;
  path.seed = std::uint64_t(random_fraction(plan.path.seed, client) * 0x1p53);
  return path;
}

// Close codes after which another server, or this one later, may go on.
bool is_to_be_found_again(unsigned code) {
  return code == static_cast<unsigned>(CloseCode::going_away) || code == static_cast<unsigned>(CloseCode::internal);
}

}  // namespace

LoadClient::LoadClient(asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, unsigned number, LoadFigures& figures,
                       LoadProgress& progress)
    : LoadClient(io, endpoints, plan, path_of(plan, number), plan.start + plan.ramp * number / plan.clients, figures, progress) {}

LoadClient::LoadClient(asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, const CameraPath& path, Time start,
                       LoadFigures& figures, LoadProgress& progress)
    : plan_(plan),
      figures_(figures),
      progress_(progress),
      start_(start),
      connection_(io, endpoints, plan, path.seed),
      views_(path, start, figures),
      stream_(plan, figures),
      wake_(io),
      line_(io) {}

asio::awaitable<void> LoadClient::run() {
  wake_.expires_at(start_);
  co_await wake_.async_wait(kAwait);
  if (co_await connection_.open()) {
    ++figures_.connected;
    views_.begin(LoadClock::now());
    stream_.look(views_.lod().camera);
    co_await converse();
    while (lost_ && !failed_) {
      gone_ = lost_ = false;
      credit_due_ = 0;
      stream_.begin_again();
      const bool found = co_await connection_.open_again();
      if (!found) {
        fail(connection_.complaint());
        break;
      }
      ++figures_.reconnects;
      co_await converse();
    }
  } else {
    fail(connection_.complaint());
  }
  figures_.repeated_updates += stream_.repeated_updates();
  views_.report_rest(failed_, LoadClock::now());
}

asio::awaitable<void> LoadClient::converse() {
  using namespace asio::experimental::awaitable_operators;
  connected_ = true;
  ++progress_.connected;
  co_await (read_messages() && write_messages());
  --progress_.connected;
  connected_ = false;
}

asio::awaitable<void> LoadClient::write_messages() {
  if (!co_await greet()) co_return;
  while (!gone_) {
    if (closing_) {
      // Within the plan's patience; an error is a server that left first.
      co_await connection_.websocket().async_close(websocket::close_code::normal, kAwait);
      co_return cut_off();
    }
    if (const std::uint64_t bytes = std::exchange(credit_due_, 0); bytes != 0) {
      const protocol::ClientMessage credit = protocol::Credit{bytes};
      if (!co_await send(credit)) co_return;
    } else if (advance()) {
      const protocol::ClientMessage message = view();
      if (!co_await send(message)) co_return;
    } else {
      wake_.expires_at(views_.next_due());
      co_await wake_.async_wait(kAwait);
    }
  }
}

// Open, the first grant, what the client has, and a view go out together, to save a round trip. Messages have names: g++ 12 destroys temporaries in a
// co_await twice.
asio::awaitable<bool> LoadClient::greet() {
  const auto greeting = stream_.greeting();
  asked_ = LoadClock::now();
  for (const protocol::ClientMessage& message : greeting) {
    if (std::holds_alternative<protocol::Have>(message)) figures_.resume_bytes += protocol::encode(message).size();
    if (!co_await send(message)) co_return false;
  }
  (void)advance();
  const protocol::ClientMessage first = view();
  const bool sent = co_await send(first);
  co_return sent;
}

asio::awaitable<bool> LoadClient::send(const protocol::ClientMessage& message) {
  const auto bytes = protocol::encode(message);
  const auto [error, size] = co_await connection_.websocket().async_write(asio::buffer(bytes), kAwait);
  if (error) lost(error);
  co_return !error;
}

// To the newest view that is due, if any is.
bool LoadClient::advance() {
  if (!views_.advance(LoadClock::now())) return false;
  stream_.look(views_.lod().camera);
  return true;
}

asio::awaitable<void> LoadClient::read_messages() {
  while (!gone_) {
    buffer_.clear();
    const auto [error, size] = co_await connection_.websocket().async_read(buffer_, kAwait);
    if (error) co_return lost(error);
    if (plan_.rate) co_await pass_line(buffer_.size());
    if (!closing_ && !gone_) receive(buffer_.size());
  }
}

// A message has come only once the line it comes by has carried it: what lies ready in this machine is still on its way there.
asio::awaitable<void> LoadClient::pass_line(std::size_t bytes) {
  const std::chrono::duration<double> time(double(bytes) / double(*plan_.rate));
  line_free_ = std::max(line_free_, LoadClock::now()) + std::chrono::duration_cast<LoadClock::duration>(time);
  if (closing_ || gone_) co_return;
  line_.expires_at(line_free_);
  co_await line_.async_wait(kAwait);
}

void LoadClient::receive(std::size_t size) {
  now_ = LoadClock::now();
  if (connection_.websocket().got_text()) return fail("the server sent text");
  auto message = protocol::decode_server_message({static_cast<const std::uint8_t*>(buffer_.data().data()), size});
  if (!message) return fail("the server sent a " + message.error().message);
  bytes_ += size;
  if (now_ <= plan_.end()) {
    figures_.bytes += size;
    progress_.bytes += size;
  }
  std::visit([this](auto& m) { take(std::move(m)); }, *message);
}

void LoadClient::take(protocol::Opened opened) {
  const auto taken = stream_.take(std::move(opened), buffer_.size(), now_ - asked_);
  if (!taken) fail(taken.error().message);
}

void LoadClient::take(const protocol::Batch& batch) {
  if (auto taken = stream_.take(batch, views_.epoch()); !taken) return fail(taken.error().message);
  if (now_ <= plan_.end()) {
    figures_.updates += batch.updates;
    progress_.updates += batch.updates;
  }
  views_.serve(batch.epoch, now_);
  views_.note_bytes(buffer_.size());
  if (auto applied = stream_.apply(batch); !applied) return fail(applied.error().message);
  if (plan_.verify) now_ = LoadClock::now();
  if (batch.updates > 0 && !stream_.shows_nothing()) views_.note_mesh(bytes_, now_);
  close_if_answered();
  credit_due_ += stream_.grant(batch, now_);
  if (credit_due_ != 0) wake_.cancel();
}

void LoadClient::take(const protocol::Done& done) {
  if (auto taken = stream_.take(done, views_.epoch()); !taken) return fail(taken.error().message);
  views_.finish(done.epoch, !done.full, now_);
  if (views_.is_only_one()) return leave();
  close_if_answered();
}

void LoadClient::take(const protocol::Fault& fault) {
  ++figures_.protocol_closes;
  const std::string what =
      "the server ended the session: " + printable(fault.text) + " (code " + std::to_string(static_cast<unsigned>(fault.code)) + ")";
  if (is_to_be_found_again(static_cast<unsigned>(fault.code))) return lose(what);
  fail(what);
}

void LoadClient::end_views() {
  views_.end();
  close_if_answered();
}

void LoadClient::close_if_answered() {
  if (views_.are_over()) leave();
}

void LoadClient::leave() {
  closing_ = true;
  if (!connected_) fail(views_.is_lost() ? connection_.complaint() + ", and not found again before the end" : "not connected before the end");
  wake_.cancel();
  line_.cancel();
}

// The connection is over. In order, if it was to be.
void LoadClient::lost(beast::error_code error) {
  if (closing_ || gone_) return cut_off();
  if (error != websocket::error::closed) return lose("lost the server: " + error.message());
  ++figures_.protocol_closes;
  const unsigned code = connection_.websocket().reason().code;
  const std::string what = "the server closed the session with code " + std::to_string(code);
  if (is_to_be_found_again(code)) return lose(what);
  fail(what);
}

// There may be another server.
void LoadClient::lose(const std::string& what) {
  if (!plan_.reconnect) return fail(what);
  views_.lose(LoadClock::now());
  lost_ = true;
  connection_.lose(what);
  cut_off();
}

void LoadClient::fail(const std::string& what) {
  if (failed_) return;
  failed_ = true;
  ++figures_.failed;
  ++figures_.errors[what];
  connection_.give_up();
  cut_off();
}

void LoadClient::cut_off() {
  gone_ = true;
  connection_.cut();
  wake_.cancel();
  line_.cancel();
}

}  // namespace intervale
