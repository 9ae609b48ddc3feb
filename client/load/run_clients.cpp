#include "client/load/run_clients.h"

#include <algorithm>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <chrono>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "client/core/client_session.h"
#include "client/core/draw_depth_map.h"
#include "client/load/load_connection.h"
#include "client/load/load_views.h"
#include "client/load/range_path.h"
#include "protocol/transport/await.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using Time = LoadClock::time_point;

CameraPath path_of(const LoadPlan& plan, unsigned client) {
  return {.scenario = plan.scenario,
          .box = box_of(plan.description.grid),
          .pixel_error = plan.pixel_error,
          .views_per_second = plan.views_per_second,
          .seed = std::uint64_t(random_fraction(plan.seed, client) * 0x1p53)};
}

// One client: a WebSocket that asks for views by its own timetable and measures what it receives. It opens one
// connection after the other, as long as its server is lost and found again. Each has two coroutines: the reader
// receives messages and measures; the writer sends credit, and views as they are due, and alone closes.
class LoadClient {
 public:
  // start: when it is to connect. All references but the path outlive this; stats and progress are added to.
  LoadClient(asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, const CameraPath& path, Time start,
             LoadStats& stats, LoadProgress& progress)
      : plan_(plan),
        stats_(stats),
        progress_(progress),
        start_(start),
        connection_(io, endpoints, plan, path.seed),
        drags_{plan.shown.ranges.empty() ? Range{} : plan.shown.ranges[0], values_of(plan.description), path.seed},
        views_(path, start, stats),
        session_({.dataset = plan.url.name, .client = "intervale-load " INTERVALE_VERSION, .window = plan.window, .has_mesh = plan.verify}),
        wake_(io),
        rate_timer_(io) {}
  LoadClient(const LoadClient&) = delete;
  LoadClient& operator=(const LoadClient&) = delete;

  // From the wait for its start to the end of its last connection. What goes wrong is in the stats.
  asio::awaitable<void> run() {
    wake_.expires_at(start_);
    co_await wake_.async_wait(kAwait);
    bool is_open = co_await connection_.open();
    if (is_open) {
      ++stats_.connected;
      views_.begin(LoadClock::now(), plan_.end());
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

  // The duration is over: no new views; closes once all are answered.
  void end_views() {
    views_.end();
    leave_if_answered();
  }

  // Closes.
  void leave() {
    if (state_ == State::connecting) return fail("not connected before the end");
    if (state_ == State::lost) return fail(connection_.complaint() + ", and not found again before the end");
    if (state_ == State::connected) state_ = State::closing;
    wake_.cancel();
    rate_timer_.cancel();
  }

  // After run(). Nothing if the plan wants none, or if it may be damaged.
  [[nodiscard]] std::optional<LoadedMesh> take_mesh() {
    const Description* description = session_.description();
    // Nothing to compare it with.
    if (description && description->content_hash != plan_.description.content_hash) return {};
    auto mesh = std::move(session_).take_mesh();
    if (!mesh) return {};
    return LoadedMesh{*std::move(mesh), views_.lod(), views_.is_complete()};
  }

 private:
  enum class State : std::uint8_t {
    connecting,  // to its first server
    connected,   // a WebSocket is open
    closing,     // ... and is to be closed in order: what still arrives does not count
    lost,        // the server is lost, and another one is looked for
    closed,      // the end, in order
    failed,      // the end, with an error
  };

  asio::awaitable<void> converse() {
    using namespace asio::experimental::awaitable_operators;
    const Time now = LoadClock::now();
    state_ = State::connected;
    views_.advance(now);
    look();
    session_.connected(now);
    views_.asked(session_.epoch());
    ++progress_.connected;
    co_await (read_messages() && write_messages());
    --progress_.connected;
    session_.disconnected();
  }

  // Messages have names: g++ 12 destroys temporaries in a co_await twice.
  asio::awaitable<void> write_messages() {
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
      if (!messages.empty()) continue;
      if (views_.advance(LoadClock::now())) {  // asks for the newest view that is due
        look();
        views_.asked(session_.epoch());
        continue;
      }
      wake_.expires_at(views_.next_due());
      co_await wake_.async_wait(kAwait);
    }
  }

  void look() {
    const Lod lod = views_.lod();
    const bool sets_range = plan_.scenario == Scenario::range && session_.mesh();
    const Time before = LoadClock::now();
    const bool drags = plan_.scenario == Scenario::range;  // as the viewer does
    const auto coarse = drags ? std::optional(kCoarseErrorPercent) : std::nullopt;
    (void)session_.look({.lod = lod,
                         .camera = lod.camera,
                         .budget = plan_.budget,
                         .shown = shown(),  // of the data set
                         .early = drags,
                         .coarse_error_percent = coarse,
                         .is_opaque = plan_.depth_maps,
                         .ahead = lod.camera ? motion_.next(*lod.camera, before) : std::nullopt});
    const std::chrono::duration<double, std::milli> took = LoadClock::now() - before;
    if (sets_range) stats_.set_range_ms.push_back(took.count());
  }

  // By the newest view that is due.
  [[nodiscard]] RangeRequest shown() const {
    RangeRequest shown = plan_.shown;
    if (plan_.scenario == Scenario::range) shown.ranges = {range_of(drags_, views_.number())};
    return shown;
  }

  asio::awaitable<void> read_messages() {
    while (is_connected()) {
      buffer_.clear();
      const auto [error, size] = co_await connection_.websocket().async_read(buffer_, kAwait);
      if (error) co_return end_connection(error);
      if (plan_.rate) co_await wait_for_rate(buffer_.size());
      if (state_ == State::connected) receive(buffer_.size());
    }
  }

  [[nodiscard]] bool is_connected() const { return state_ == State::connected || state_ == State::closing; }

  // A message counts as received once a connection of the plan's rate would have carried it: what this machine holds
  // ready would still be on its way there.
  asio::awaitable<void> wait_for_rate(std::size_t bytes) {
    const std::chrono::duration<double> time(double(bytes) / double(*plan_.rate));
    received_until_ = std::max(received_until_, LoadClock::now()) + std::chrono::duration_cast<LoadClock::duration>(time);
    if (state_ != State::connected) co_return;
    rate_timer_.expires_at(received_until_);
    co_await rate_timer_.async_wait(kAwait);
  }

  void receive(std::size_t size) {
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

  // Of the mesh without any update: no budget makes it smaller.
  [[nodiscard]] std::uint64_t root_tets() const { return StreamClient::start(plan_.description, {}, shown())->tet_count(); }

  void take_opened(bool resumes, bool is_new_mesh, std::size_t size) {
    if (session_.description()->content_hash != plan_.description.content_hash) return fail("the server sent another volume than before");
    if (resumes && is_new_mesh) return fail("the server has the same volume, but does not resume");
    if (resumes) stats_.repeated_bytes += size;
  }

  void take_batch(const ClientSession::Event& batch, std::size_t size, Time now) {
    if (now <= plan_.end()) {
      stats_.updates += batch.updates;
      progress_.updates += batch.updates;
    }
    views_.serve(batch.epoch, now);
    views_.note_bytes(size);
    const StreamClient* mesh = session_.mesh();
    if (mesh && mesh->tet_count() > plan_.budget.max_tets && mesh->tet_count() > root_tets()) return fail("a mesh exceeds its budget");
    const bool is_seen = batch.updates > 0 && (!mesh || mesh->tet_count() > 0);
    if (is_seen) views_.note_mesh(session_.stats().bytes, mesh ? LoadClock::now() : now);
    if (session_.wants_depth_map()) send_depth_map(*mesh);
    leave_if_answered();
  }

  // Of the view that was sent last, which is sent again with it.
  void send_depth_map(const StreamClient& mesh) {
    auto map = draw_depth_map(mesh, *views_.lod().camera);
    if (!map) return;
    session_.send_depth_map(*std::move(map));
    ++stats_.depth_maps;
  }

  void take_done(const ClientSession::Event& done, Time now) {
    views_.finish(done.epoch, !done.is_full, now);
    if (views_.is_only_one()) return leave();
    leave_if_answered();
  }

  void leave_if_answered() {
    if (views_.are_over()) leave();
  }

  // A read or a write failed: as was to be expected, or the server ended the session.
  void end_connection(beast::error_code error) {
    if (state_ == State::closing) return cut_off(State::closed);
    if (state_ != State::connected) return;
    if (error != websocket::error::closed) return end_session("lost the server: " + error.message(), true);
    ++stats_.protocol_closes;
    const unsigned code = connection_.websocket().reason().code;
    end_session("the server closed the session with code " + std::to_string(code), may_reconnect(protocol::CloseCode(code)));
  }

  void end_session(const std::string& what, bool may_reconnect) {
    if (!may_reconnect || !plan_.reconnect) return fail(what);
    views_.lose(LoadClock::now());
    connection_.lose(what);
    cut_off(State::lost);
  }

  void fail(const std::string& what) {
    if (state_ == State::failed) return;
    ++stats_.failed;
    ++stats_.errors[what];
    connection_.give_up();
    cut_off(State::failed);
  }

  void cut_off(State state) {
    state_ = state;
    connection_.cut();
    wake_.cancel();
    rate_timer_.cancel();
  }

  void report() {
    const ClientSession::Stats& session = session_.stats();
    stats_.resume_bytes += session.have_bytes;
    if (session_.mesh() && session_.state() != ClientSession::State::closed) {
      stats_.repeated_updates += session.updates - session.forgotten - session_.mesh()->updates();
    }
    // Not the time that closing took.
    views_.report_rest(state_ == State::failed, std::min(LoadClock::now(), plan_.end() + plan_.grace));
  }

  const LoadPlan& plan_;
  LoadStats& stats_;
  LoadProgress& progress_;
  Time start_;  // when it is to connect
  State state_ = State::connecting;
  LoadConnection connection_;
  RangePath drags_;  // in the scenario range
  LoadViews views_;
  ClientSession session_;
  CameraMotion motion_;
  beast::flat_buffer buffer_;
  asio::steady_timer wake_;        // the writer sleeps on it
  asio::steady_timer rate_timer_;  // the reader does, where the rate is limited
  Time received_until_{};          // when all that was received would have been at that rate
};

asio::awaitable<void> end_on_time(asio::steady_timer& timer, const LoadPlan& plan, std::vector<std::unique_ptr<LoadClient>>& clients) {
  timer.expires_at(plan.end());
  if (const auto [error] = co_await timer.async_wait(kAwait); error) co_return;  // all clients have ended already
  for (const auto& client : clients) {
    if (client) client->end_views();
  }
  timer.expires_at(plan.end() + plan.grace);
  if (const auto [error] = co_await timer.async_wait(kAwait); error) co_return;
  for (const auto& client : clients) {
    if (client) client->leave();
  }
}

}  // namespace

LoadStats run_clients(const LoadPlan& plan, unsigned first, unsigned step, std::span<std::optional<LoadedMesh>> meshes, LoadProgress& progress) {
  asio::io_context io(1);
  const auto endpoints = tcp::resolver(io).resolve(plan.url.host, plan.url.port);
  LoadStats stats;
  std::vector<std::unique_ptr<LoadClient>> clients;
  for (unsigned number = first; number < plan.clients; number += step) {
    const Time start = plan.start + plan.ramp * number / plan.clients;
    clients.push_back(std::make_unique<LoadClient>(io, endpoints, plan, path_of(plan, number), start, stats, progress));
  }
  asio::steady_timer end(io);
  std::size_t running = clients.size();
  std::exception_ptr failure;
  for (std::size_t i = 0; i < clients.size(); ++i) {
    asio::co_spawn(io, clients[i]->run(), [&, i](const std::exception_ptr& thrown) {
      if (thrown) failure = thrown;
      if (plan.verify) meshes[first + i * step] = clients[i]->take_mesh();
      clients[i].reset();  // the timer of a closed WebSocket would keep the io_context running
      if (--running == 0) end.cancel();
    });
  }
  asio::co_spawn(io, end_on_time(end, plan, clients), [&](const std::exception_ptr& thrown) {
    if (thrown) failure = thrown;
  });
  io.run();
  if (failure) std::rethrow_exception(failure);
  return stats;
}

}  // namespace intervale
