#include "client/net/fetch.h"

#include <random>
#include <thread>
#include <utility>

#include "client/core/backoff.h"
#include "client/core/draw_depth_map.h"
#include "client/net/connection.h"

namespace intervale {
namespace {

using Clock = ClientSession::Clock;

class Fetch {
 public:
  Fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events)
      : url_(url),
        options_(options),
        events_(events),
        session_({.dataset = url.name,
                  .client = "intervale-client " INTERVALE_VERSION,
                  .server = "the server at " + url.authority(),
                  .max_bytes = options.max_bytes}) {
    (void)look(options.shown.refine);  // no data set is known yet
  }

  Result<void> run() {
    auto done = stream();
    while (!done && is_lost() && options_.reconnect.count() > 0) done = reconnect(done.error());
    return done;
  }

  Fetched finish() && {
    stats_.session = session_.stats();
    stats_.is_complete = is_complete();
    stats_.seconds = elapsed();
    connection_->close();
    return {*std::move(session_).take_mesh(), stats_};
  }

 private:
  // Over one connection. If there is none, connection_ stays empty.
  Result<void> stream() {
    auto connection = StreamConnection::open(url_);
    if (!connection) return tl::unexpected(connection.error());
    connection_ = std::move(*connection);
    session_.connected(Clock::now());
    if (auto sent = connection_->send(session_); !sent) return sent;
    while (!has_enough()) {
      if (auto received = receive(); !received) return received;
    }
    return {};
  }

  Result<void> receive() {
    const bool had_mesh = session_.mesh() != nullptr;
    const auto event = connection_->receive(session_);
    if (!event) return tl::unexpected(event.error());
    if (event->kind == ClientSession::Event::Kind::opened) {
      if (auto begun = opened(*session_.description()); !begun) return begun;
    }
    if (event->is_new_mesh && had_mesh) notice("the data at " + url_.authority() + " changed meanwhile; starting again");
    const StreamClient& client = *session_.mesh();
    if (stats_.seconds_first_mesh == 0 && client.tet_count() > 0) stats_.seconds_first_mesh = elapsed();
    stats_.session = session_.stats();
    if (event->kind == ClientSession::Event::Kind::batch && events_.on_batch) events_.on_batch(client, stats_);
    if (!session_.wants_depth_map()) return {};
    auto map = draw_depth_map(client, *options_.lod.camera);
    if (!map) return {};
    session_.send_depth_map(*std::move(map));
    return connection_->send(session_);
  }

  Result<void> opened(const Description& description) {
    if (description.has_every_range && options_.shown.ranges.empty())
      return misuse("'" + url_.name + "' has every range: say which with --range LO HI");
    if (!options_.prefers_uniform || options_.shown.refine || description.refine != Refine::uniform) return {};
    if (auto looked = look(Refine::uniform); !looked) return looked;
    return connection_->send(session_);
  }

  Result<void> look(const std::optional<Refine>& refine) {
    return session_.look({.lod = options_.lod,
                          .budget = {.max_tets = options_.lod.max_tets.value_or(UINT64_MAX)},
                          .shown = {options_.shown.ranges, refine},
                          .channels = options_.channels,
                          .is_opaque = options_.is_opaque});
  }

  // Fails with `why` once the time for it is over, or as stream() does.
  Result<void> reconnect(const Error& why) {
    notice(why.message + "; connecting again");
    const auto deadline = Clock::now() + options_.reconnect;
    Backoff backoff(std::random_device{}());
    session_.disconnected();
    connection_.reset();
    Result<void> done;
    while (!connection_) {
      const auto wait = backoff.next();
      if (Clock::now() + wait > deadline) return tl::unexpected(why);
      std::this_thread::sleep_for(wait);
      done = stream();
    }
    return done;
  }

  void notice(const std::string& text) const {
    if (events_.on_notice) events_.on_notice(text);
  }
  [[nodiscard]] double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  [[nodiscard]] bool is_complete() const { return session_.state() == ClientSession::State::idle; }
  [[nodiscard]] bool has_enough() const { return is_complete() || session_.is_exhausted() || (session_.mesh() && session_.mesh()->over_budget()); }
  [[nodiscard]] bool is_lost() const { return session_.mesh() && connection_ && connection_->is_lost(); }

  const ServerUrl& url_;
  const FetchOptions& options_;
  const FetchEvents& events_;
  Clock::time_point start_ = Clock::now();
  std::optional<StreamConnection> connection_;
  ClientSession session_;
  FetchStats stats_;
};

}  // namespace

Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events) {
  if (auto ok = check_lod(options.lod); !ok) return tl::unexpected(ok.error());
  Fetch stream(url, options, events);
  if (auto run = stream.run(); !run) return tl::unexpected(run.error());
  return std::move(stream).finish();
}

}  // namespace intervale
