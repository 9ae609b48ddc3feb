#include "client/net/fetch.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <variant>

#include "client/core/backoff.h"
#include "client/core/grants.h"
#include "client/net/connection.h"

namespace intervale {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kDoneBytes = 128;  // more than a Done message takes
constexpr std::uint64_t kEpoch = 1;        // one view for the whole stream

class Fetch {
 public:
  Fetch(ServerUrl url, const FetchOptions& options, const FetchEvents& events) : url_(std::move(url)), options_(options), events_(events) {
    if (!options_.max_bytes) grants_ = Grants(UINT64_MAX);
  }

  Result<void> run();
  Fetched finish() &&;

 private:
  Result<void> run_session();
  Result<void> open();
  Result<void> take_description(protocol::Opened& opened);
  Result<void> receive();
  Result<void> apply(const protocol::Batch& batch);
  Result<void> grant();
  tl::unexpected<Error> nonsense(const std::string& what) const { return fail("the server at " + url_.authority() + " sent nonsense: " + what); }
  [[nodiscard]] double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  [[nodiscard]] bool has_enough() const { return client_ && (client_->over_budget() || grants_.exhausted()); }
  void count() {
    figures_.bytes_received = bytes_before_ + connection_->bytes_received();
    figures_.messages = messages_before_ + connection_->messages();
  }
  void note_first_mesh() {
    if (figures_.seconds_first_mesh == 0 && client_->tet_count() > 0) figures_.seconds_first_mesh = elapsed();
  }

  ServerUrl url_;
  const FetchOptions& options_;
  const FetchEvents& events_;
  Clock::time_point start_ = Clock::now();
  std::optional<StreamConnection> connection_;
  std::optional<StreamClient> client_;
  Grants grants_{0};
  std::uint64_t sequence_ = 0;
  std::uint64_t bytes_before_ = 0, messages_before_ = 0;  // of sessions that are over
  FetchFigures figures_;
};

Result<void> Fetch::run() {
  auto done = run_session();
  while (!done && client_ && connection_ && connection_->is_lost() && options_.reconnect.count() > 0) {
    if (events_.on_notice) events_.on_notice(done.error().message + "; connecting again");
    const auto deadline = Clock::now() + options_.reconnect;
    Backoff backoff(std::random_device{}());
    const auto first_error = done.error();
    count();
    bytes_before_ = figures_.bytes_received;
    messages_before_ = figures_.messages;
    connection_.reset();
    while (!connection_) {
      const auto wait = backoff.next();
      if (Clock::now() + wait > deadline) return tl::unexpected(first_error);
      std::this_thread::sleep_for(wait);
      ++figures_.reconnects;
      done = run_session();
      if (done || connection_) break;
      --figures_.reconnects;
    }
  }
  return done;
}

Result<void> Fetch::run_session() {
  auto connection = StreamConnection::open(url_);
  if (!connection) return tl::unexpected(connection.error());
  connection_ = std::move(*connection);
  sequence_ = 0;
  if (auto opened = open(); !opened) return opened;
  while (!has_enough() && !figures_.complete) {
    if (auto received = receive(); !received) return received;
  }
  return {};
}

// Open, what the client has, View and the first grant go out together, to save a round trip; with a budget, the grant waits until it is known what
// Opened took of it.
Result<void> Fetch::open() {
  grants_.forget_outstanding();
  protocol::Open open{url_.name, "intervale-client " INTERVALE_VERSION, options_.max_bytes ? 0 : grants_.take_all(), {}};
  if (client_) open.resume = client_->description().content_hash;
  if (auto sent = connection_->send(open); !sent) return sent;
  if (client_) {
    const auto splits = client_->resume();
    for (std::size_t first = 0; first < splits.size(); first += protocol::kMaxHave) {
      const std::size_t count = std::min(protocol::kMaxHave, splits.size() - first);
      const auto some = splits.begin() + std::ptrdiff_t(first);
      if (auto sent = connection_->send(protocol::Have{{some, some + std::ptrdiff_t(count)}}); !sent) return sent;
    }
  }
  if (auto sent = connection_->send(protocol::View{kEpoch, options_.lod}); !sent) return sent;
  const auto asked = Clock::now();
  auto answer = connection_->receive();
  if (!answer) return tl::unexpected(answer.error());
  const auto round_trip = Clock::now() - asked;
  auto* opened = std::get_if<protocol::Opened>(&*answer);
  if (opened == nullptr) return nonsense("something else than the data set's description");
  if (auto taken = take_description(*opened); !taken) return taken;
  note_first_mesh();
  count();
  grants_.round_trip(round_trip);
  if (!options_.max_bytes) return {};
  const std::uint64_t taken = figures_.bytes_received + kDoneBytes;
  grants_ = Grants(*options_.max_bytes > taken ? *options_.max_bytes - taken : 0);
  grants_.round_trip(round_trip);
  return grant();
}

Result<void> Fetch::take_description(protocol::Opened& opened) {
  if (client_ && opened.resumed) return {};
  if (client_ && events_.on_notice) events_.on_notice("the data at " + url_.authority() + " changed meanwhile; starting afresh");
  auto client = StreamClient::start(std::move(opened.description), {.max_tets = options_.lod.max_tets.value_or(UINT64_MAX)});
  if (!client) return nonsense(client.error().message);
  client_ = std::move(*client);
  return {};
}

Result<void> Fetch::receive() {
  const auto message = connection_->receive();
  count();
  if (!message) return tl::unexpected(message.error());
  if (const auto* done = std::get_if<protocol::Done>(&*message)) {
    figures_.remaining_error = figures_.remaining_pixels = 0;
    figures_.updates_to_go = 0;
    figures_.complete = true;
    if (done->updates_sent != client_->updates()) return nonsense("the end of the stream, with updates missing");
    return {};
  }
  const auto* batch = std::get_if<protocol::Batch>(&*message);
  if (batch == nullptr) return nonsense("a message that is out of order");
  if (auto applied = apply(*batch); !applied) return applied;
  if (events_.on_batch) events_.on_batch(*client_, figures_);
  return {};
}

Result<void> Fetch::apply(const protocol::Batch& batch) {
  if (batch.sequence != sequence_++ || batch.epoch != kEpoch) return nonsense("a batch that is out of order");
  if (!grants_.spend(protocol::cost_of(batch))) return nonsense("more than it was granted");
  const std::uint64_t before = client_->updates();
  const auto start = Clock::now();
  if (auto applied = client_->apply(batch.payload, batch.epoch); !applied) return nonsense(applied.error().message);
  figures_.seconds_applying += std::chrono::duration<double>(Clock::now() - start).count();
  if (client_->updates() - before != batch.updates) return nonsense("a batch of another size than it says");
  note_first_mesh();
  figures_.remaining_error = batch.remaining_error;
  figures_.remaining_pixels = batch.remaining_pixels;
  figures_.updates_to_go = batch.updates_to_go;
  grants_.applied(protocol::cost_of(batch), Clock::now());
  return grant();
}

Result<void> Fetch::grant() {
  while (const std::uint64_t bytes = grants_.take()) {
    if (auto sent = connection_->send(protocol::Credit{bytes}); !sent) return sent;
  }
  return {};
}

Fetched Fetch::finish() && {
  count();
  figures_.seconds = elapsed();
  connection_->close();
  return {std::move(*client_), figures_};
}

}  // namespace

Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events) {
  if (auto ok = check_lod(options.lod); !ok) return tl::unexpected(ok.error());
  Fetch stream(url, options, events);
  if (auto run = stream.run(); !run) return tl::unexpected(run.error());
  return std::move(stream).finish();
}

}  // namespace intervale
