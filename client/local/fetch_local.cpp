#include "client/local/fetch_local.h"

#include <atomic>
#include <chrono>
#include <future>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/ivm/coarse_scales.h"
#include "protocol/codec.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"

namespace intervale {
namespace {

using SharedVolume = std::shared_ptr<const IntervalVolume>;

// Passes on what the client has to say. A message that the sending side refuses is answered by its fault.
std::optional<protocol::Fault> pass_messages(ClientSession& client, SessionState& server) {
  for (const auto& bytes : client.take_messages()) {
    const auto message = protocol::decode_client_message(bytes);
    if (!message) return protocol::Fault{protocol::CloseCode::malformed, message.error().message};
    if (auto fault = server.receive(*message)) return fault;
  }
  return {};
}

// Both sides of a stream.
class LocalStream {
 public:
  LocalStream(SharedVolume volume, const FetchOptions& options, const FetchEvents& events)
      : volume_(std::move(volume)),
        server_([this](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return volume_; }, worker_,
                options.on_demand ? SessionState::Growth::on_demand : SessionState::Growth::by_itself),
        fetch_(name(), "'" + name() + "'", options, events) {
    fetch_.session().connected(FetchSession::Clock::now());
  }
  LocalStream(const LocalStream&) = delete;
  LocalStream& operator=(const LocalStream&) = delete;

  // One message, or some work for one. False: there is nothing to do before the data set grows.
  Result<bool> step() {
    std::optional<protocol::ServerMessage> message;
    if (auto fault = pass_messages(fetch_.session(), server_)) {
      message = std::move(*fault);
    } else {
      message = server_.next();
    }
    if (!message) return server_.waits() ? worker_.work() : server_.has_work();
    const auto event = fetch_.session().receive(protocol::encode(*message), FetchSession::Clock::now());
    if (!event) return tl::unexpected(event.error());
    if (auto received = fetch_.received(*event); !received) return tl::unexpected(received.error());
    return true;
  }
  [[nodiscard]] bool has_enough() const { return fetch_.has_enough(); }
  void grow(SharedVolume volume) { volume_ = std::move(volume); }
  void end_growth() {
    server_.end_growth();
    is_grown_ = true;
  }
  [[nodiscard]] bool is_grown() const { return is_grown_; }
  [[nodiscard]] const SharedVolume& volume() const { return volume_; }
  [[nodiscard]] const std::string& name() const { return volume_->description().name; }
  [[nodiscard]] Fetched finish() && { return std::move(fetch_).finish(); }

 private:
  SharedVolume volume_;
  LocalWorker worker_;
  SessionState server_;
  FetchSession fetch_;
  bool is_grown_ = false;
};

// What is read on another thread meanwhile. Its end ends that.
class ReadAhead {
 public:
  ReadAhead(const NextVolume& next, const ParallelFor& parallel) : next_(next), parallel_(parallel) {}
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;
  ~ReadAhead() {
    is_stopped_ = true;
    if (under_way_.valid()) under_way_.wait();
  }

  void start() {
    under_way_ = std::async(std::launch::async, [this] {
      return next_(ReadOn::one_scale, [this](std::size_t count, const std::function<void(std::size_t)>& piece) {
        if (is_stopped_) throw std::runtime_error("stopped");
        parallel_(count, piece);
      });
    });
  }
  [[nodiscard]] bool is_under_way() const { return under_way_.valid(); }
  [[nodiscard]] bool is_there() const { return is_under_way() && under_way_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }
  // Waits for it.
  [[nodiscard]] Result<SharedVolume> take() { return under_way_.get(); }

 private:
  const NextVolume& next_;
  const ParallelFor& parallel_;
  std::atomic<bool> is_stopped_ = false;
  std::future<Result<SharedVolume>> under_way_;
};

}  // namespace

Result<Fetched> fetch_local(const std::shared_ptr<const IntervalVolume>& volume, const FetchOptions& options, const FetchEvents& events) {
  return fetch_growing([&volume](ReadOn, const ParallelFor&) -> Result<SharedVolume> { return volume; }, options, events);
}

Result<Fetched> fetch_growing(const NextVolume& next, const FetchOptions& options, const FetchEvents& events, const ParallelFor& parallel) {
  if (auto ok = check_lod(options.lod); !ok) return tl::unexpected(ok.error());
  ReadAhead ahead(next, parallel);
  std::optional<LocalStream> stream;
  const auto take = [&](Result<SharedVolume> read) -> Result<void> {
    if (!read) return tl::unexpected(read.error());
    const Description& description = (*read)->description();
    if (auto fits = protocol::check_sendable(description); !fits) return fits;
    if (stream && description.content_hash == stream->volume()->description().content_hash) {
      stream->grow(*std::move(read));
    } else {
      if (stream && events.on_notice) events.on_notice("the data of '" + stream->name() + "' changed meanwhile; starting again");
      stream.emplace(*std::move(read), options, events);
    }
    const auto wants = options.on_demand ? estimates_want_finer : wants_finer;
    if (wants(*stream->volume(), options.lod)) ahead.start();
    return {};
  };
  if (auto begun = take(next(takes_coarse_first(options) ? ReadOn::one_scale : ReadOn::all, parallel)); !begun) return tl::unexpected(begun.error());
  while (!stream->has_enough()) {
    const auto worked = stream->step();
    if (!worked) return tl::unexpected(worked.error());
    if (ahead.is_there() || (!*worked && ahead.is_under_way())) {
      if (auto taken = take(ahead.take()); !taken) return tl::unexpected(taken.error());
    } else if (!*worked) {
      if (stream->volume()->is_whole() || stream->is_grown()) return fail("'" + stream->name() + "': the stream does not end");
      stream->end_growth();
    }
  }
  return std::move(*stream).finish();
}

}  // namespace intervale
