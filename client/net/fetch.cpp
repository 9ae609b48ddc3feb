#include "client/net/fetch.h"

#include <chrono>
#include <random>
#include <thread>
#include <utility>

#include "client/core/backoff.h"
#include "client/net/connection.h"

namespace intervale {
namespace {

using Clock = FetchSession::Clock;

class Fetch {
 public:
  Fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events)
      : url_(url), options_(options), stream_(url.name, "the server at " + url.authority(), options, events) {}

  Result<void> run() {
    auto done = stream();
    while (!done && is_lost() && options_.reconnect.count() > 0) done = reconnect(done.error());
    return done;
  }

  Fetched finish() && {
    Fetched fetched = std::move(stream_).finish();
    connection_->close();
    return fetched;
  }

 private:
  // Over one connection. If there is none, connection_ stays empty.
  Result<void> stream() {
    auto connection = StreamConnection::open(url_);
    if (!connection) return tl::unexpected(connection.error());
    connection_ = std::move(*connection);
    stream_.session().connected(Clock::now());
    was_opened_ = false;
    if (auto sent = connection_->send(stream_.session()); !sent) return sent;
    while (!stream_.has_enough()) {
      const auto event = connection_->receive(stream_.session());
      if (!event) return tl::unexpected(event.error());
      was_opened_ = was_opened_ || event->kind != ClientSession::Event::Kind::none;
      has_progress_ = has_progress_ || event->updates > 0 || event->kind == ClientSession::Event::Kind::done;
      if (auto received = stream_.received(*event); !received) return received;
      if (auto sent = connection_->send(stream_.session()); !sent) return sent;
    }
    return {};
  }

  // Fails with `why` once the time for it is over, or as stream() does. A server that is reached again and opens the
  // data set, but sends nothing new before it ends the session, has not been reached.
  Result<void> reconnect(const Error& why) {
    if (std::exchange(has_progress_, false) || !was_opened_) {
      stream_.notice(why.message + "; connecting again");
      deadline_ = Clock::now() + options_.reconnect;
      backoff_ = Backoff(std::random_device{}());
    }
    stream_.session().disconnected();
    connection_.reset();
    Result<void> done;
    while (!connection_) {
      const auto wait = backoff_.next();
      if (Clock::now() + wait > deadline_) return tl::unexpected(why);
      std::this_thread::sleep_for(wait);
      done = stream();
    }
    return done;
  }

  [[nodiscard]] bool is_lost() const { return stream_.has_mesh() && connection_ && connection_->is_lost(); }

  const ServerUrl& url_;
  const FetchOptions& options_;
  FetchSession stream_;
  std::optional<StreamConnection> connection_;
  bool was_opened_ = false;       // over the last connection
  bool has_progress_ = true;      // since it was lost last: updates came, or the end of the stream
  Clock::time_point deadline_{};  // for reaching the server again
  Backoff backoff_{0};
};

}  // namespace

Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events) {
  if (auto ok = check_lod(options.lod); !ok) return tl::unexpected(ok.error());
  Fetch stream(url, options, events);
  if (auto run = stream.run(); !run) return tl::unexpected(run.error());
  return std::move(stream).finish();
}

}  // namespace intervale
