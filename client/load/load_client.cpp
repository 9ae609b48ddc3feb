#include "client/load/load_client.h"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <utility>

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);

CameraPath path_of(const LoadPlan& plan, unsigned client) {
  CameraPath path = plan.path;
  path.seed = std::uint64_t(random_fraction(plan.path.seed, client) * 0x1p53);
  return path;
}

}  // namespace

LoadClient::LoadClient(asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, unsigned number, LoadStats& stats,
                       LoadProgress& progress)
    : LoadClient(io, endpoints, plan, path_of(plan, number), plan.start + plan.ramp * number / plan.clients, stats, progress) {}

LoadClient::LoadClient(asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, const CameraPath& path, Time start,
                       LoadStats& stats, LoadProgress& progress)
    : plan_(plan),
      stats_(stats),
      progress_(progress),
      start_(start),
      connection_(io, endpoints, plan, path.seed),
      views_(path, start, stats),
      session_({.dataset = plan.url.name, .client = "intervale-load " INTERVALE_VERSION, .window = plan.window, .has_mesh = plan.verify}),
      wake_(io),
      rate_timer_(io) {}

asio::awaitable<void> LoadClient::run() {
  wake_.expires_at(start_);
  co_await wake_.async_wait(kAwait);
  bool is_open = co_await connection_.open();
  if (is_open) {
    ++stats_.connected;
    views_.begin(LoadClock::now());
  }
  while (is_open && (state_ == State::connecting || state_ == State::lost)) {
    co_await converse();
    if (state_ != State::lost) break;
    is_open = co_await connection_.open_again();
    if (is_open) ++stats_.reconnects;
  }
  if (!is_open) fail(connection_.complaint());
  report();
}

asio::awaitable<void> LoadClient::converse() {
  using namespace asio::experimental::awaitable_operators;
  const Time now = LoadClock::now();
  state_ = State::connected;
  views_.advance(now);
  session_.look(newest_view());
  session_.connected(now);
  views_.asked(session_.epoch());
  ++progress_.connected;
  co_await (read_messages() && write_messages());
  --progress_.connected;
  session_.disconnected();
}

// Messages have names: g++ 12 destroys temporaries in a co_await twice.
asio::awaitable<void> LoadClient::write_messages() {
  while (is_connected()) {
    if (state_ == State::closing) {
      // Within the plan's patience; an error is a server that left first.
      co_await connection_.websocket().async_close(websocket::close_code::normal, kAwait);
      co_return cut_off(State::closed);
    }
    const auto messages = session_.take_messages();
    for (const auto& message : messages) {
      const auto [error, size] = co_await connection_.websocket().async_write(asio::buffer(message), kAwait);
      if (error) co_return end_connection(error);
    }
    if (!messages.empty() || look()) continue;
    wake_.expires_at(views_.next_due());
    co_await wake_.async_wait(kAwait);
  }
}

// Asks for the newest view that is due, if any is.
bool LoadClient::look() {
  if (!views_.advance(LoadClock::now())) return false;
  session_.look(newest_view());
  views_.asked(session_.epoch());
  return true;
}

ViewRequest LoadClient::newest_view() const {
  const Lod lod = views_.lod();
  return {lod, lod.camera, plan_.budget};
}

asio::awaitable<void> LoadClient::read_messages() {
  while (is_connected()) {
    buffer_.clear();
    const auto [error, size] = co_await connection_.websocket().async_read(buffer_, kAwait);
    if (error) co_return end_connection(error);
    if (plan_.rate) co_await wait_for_rate(buffer_.size());
    if (state_ == State::connected) receive(buffer_.size());
  }
}

// A message counts as received once a connection of the plan's rate would have carried it: what this machine holds
// ready would still be on its way there.
asio::awaitable<void> LoadClient::wait_for_rate(std::size_t bytes) {
  const std::chrono::duration<double> time(double(bytes) / double(*plan_.rate));
  received_until_ = std::max(received_until_, LoadClock::now()) + std::chrono::duration_cast<LoadClock::duration>(time);
  if (state_ != State::connected) co_return;
  rate_timer_.expires_at(received_until_);
  co_await rate_timer_.async_wait(kAwait);
}

void LoadClient::receive(std::size_t size) {
  using Kind = ClientSession::Event::Kind;
  const Time now = LoadClock::now();
  if (connection_.websocket().got_text()) return fail("the server sent text");
  const bool resumes = session_.mesh() != nullptr;
  const auto event = session_.receive({static_cast<const std::uint8_t*>(buffer_.data().data()), size}, now);
  if (now <= plan_.end()) {
    stats_.bytes += size;
    progress_.bytes += size;
  }
  if (!event) {
    if (session_.fault()) ++stats_.protocol_closes;
    return end_session(event.error().message, session_.state() == ClientSession::State::connecting);
  }
  if (event->kind == Kind::opened) take_opened(resumes, event->is_new_mesh, size);
  if (event->kind == Kind::batch) take_batch(*event, size, now);
  if (event->kind == Kind::done) take_done(*event, now);
  if (session_.has_messages()) wake_.cancel();
}

void LoadClient::take_opened(bool resumes, bool is_new_mesh, std::size_t size) {
  if (session_.description()->content_hash != plan_.description.content_hash) return fail("the server sent another volume than before");
  if (resumes && is_new_mesh) return fail("the server has the same volume, but does not resume");
  if (resumes) stats_.repeated_bytes += size;
  if (session_.mesh() && is_new_mesh) root_tets_ = session_.mesh()->tet_count();
}

void LoadClient::take_batch(const ClientSession::Event& batch, std::size_t size, Time now) {
  if (now <= plan_.end()) {
    stats_.updates += batch.updates;
    progress_.updates += batch.updates;
  }
  views_.serve(batch.epoch, now);
  views_.note_bytes(size);
  const StreamClient* mesh = session_.mesh();
  if (mesh && mesh->tet_count() > std::max(plan_.budget.max_tets, root_tets_)) return fail("a mesh exceeds its budget");
  const bool is_seen = batch.updates > 0 && (!mesh || mesh->tet_count() > 0);
  if (is_seen) views_.note_mesh(session_.stats().bytes, mesh ? LoadClock::now() : now);
  close_if_answered();
}

void LoadClient::take_done(const ClientSession::Event& done, Time now) {
  views_.finish(done.epoch, !done.is_full, now);
  if (views_.is_only_one()) return leave();
  close_if_answered();
}

void LoadClient::end_views() {
  views_.end();
  close_if_answered();
}

void LoadClient::close_if_answered() {
  if (views_.are_over()) leave();
}

void LoadClient::leave() {
  if (state_ == State::connecting) return fail("not connected before the end");
  if (state_ == State::lost) return fail(connection_.complaint() + ", and not found again before the end");
  if (state_ == State::connected) state_ = State::closing;
  wake_.cancel();
  rate_timer_.cancel();
}

// A read or a write failed: as was to be expected, or the server ended the session.
void LoadClient::end_connection(beast::error_code error) {
  if (state_ == State::closing) return cut_off(State::closed);
  if (state_ != State::connected) return;
  if (error != websocket::error::closed) return end_session("lost the server: " + error.message(), true);
  ++stats_.protocol_closes;
  const unsigned code = connection_.websocket().reason().code;
  end_session("the server closed the session with code " + std::to_string(code), may_reconnect(protocol::CloseCode(code)));
}

void LoadClient::end_session(const std::string& what, bool may_reconnect) {
  if (!may_reconnect || !plan_.reconnect) return fail(what);
  views_.lose(LoadClock::now());
  connection_.lose(what);
  cut_off(State::lost);
}

void LoadClient::fail(const std::string& what) {
  if (state_ == State::failed) return;
  ++stats_.failed;
  ++stats_.errors[what];
  connection_.give_up();
  cut_off(State::failed);
}

void LoadClient::cut_off(State state) {
  state_ = state;
  connection_.cut();
  wake_.cancel();
  rate_timer_.cancel();
}

void LoadClient::report() {
  const ClientSession::Stats& session = session_.stats();
  stats_.resume_bytes += session.have_bytes;
  if (session_.mesh() && session_.state() != ClientSession::State::closed) {
    stats_.repeated_updates += session.updates - session.forgotten - session_.mesh()->updates();
  }
  views_.report_rest(state_ == State::failed, LoadClock::now());
}

std::optional<StreamClient> LoadClient::take_mesh() {
  const Description* description = session_.description();
  // Nothing to compare it with.
  if (description && description->content_hash != plan_.description.content_hash) return {};
  return std::move(session_).take_mesh();
}

}  // namespace intervale
