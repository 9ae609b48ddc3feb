#include "client/net/fetch.h"

#include <chrono>
#include <thread>
#include <utility>

#include "client/core/reconnecting.h"
#include "client/net/connection.h"

namespace intervale {
namespace {

using Clock = FetchSession::Clock;

class Fetch {
 public:
  Fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events)
      : url_(url), options_(options), stream_(url.name, "the server at " + url.authority(), options, events), reconnecting_(options.reconnect) {}

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
    reconnecting_.connected();
    if (auto sent = connection_->send(stream_.session()); !sent) return sent;
    while (!stream_.has_enough()) {
      const auto event = connection_->receive(stream_.session());
      if (!event) return tl::unexpected(event.error());
      reconnecting_.received(*event);
      if (auto received = stream_.received(*event); !received) return received;
      if (auto sent = connection_->send(stream_.session()); !sent) return sent;
    }
    return {};
  }

  // Fails with `why` once the time for it is over, or as stream() does.
  Result<void> reconnect(const Error& why) {
    if (reconnecting_.lost()) stream_.notice(why.message + "; connecting again");
    stream_.session().disconnected();
    connection_.reset();
    Result<void> done;
    while (!connection_) {
      const auto pause = reconnecting_.pause();
      if (!pause) return tl::unexpected(why);
      std::this_thread::sleep_for(*pause);
      done = stream();
    }
    return done;
  }

  [[nodiscard]] bool is_lost() const { return stream_.has_mesh() && connection_ && connection_->is_lost(); }

  const ServerUrl& url_;
  const FetchOptions& options_;
  FetchSession stream_;
  std::optional<StreamConnection> connection_;
  Reconnecting reconnecting_;
};

}  // namespace

Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events) {
  if (auto ok = check_lod(options.lod); !ok) return tl::unexpected(ok.error());
  Fetch stream(url, options, events);
  if (auto run = stream.run(); !run) return tl::unexpected(run.error());
  return std::move(stream).finish();
}

}  // namespace intervale
