#include "client/net/fetch.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <variant>

#include "client/net/connection.h"

namespace intervale {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kDoneBytes = 128;  // more than a Done message takes
constexpr std::uint64_t kEpoch = 1;        // one view for the whole stream

// How much the server may send: a window that is opened again as batches are applied, and closes as the budget runs out.
class Grants {
 public:
  explicit Grants(std::uint64_t budget) : left_(budget) {}

  // What to grant now, 0 for nothing. Small grants are saved up, for each is a message.
  std::uint64_t take() {
    const std::uint64_t wish = std::min(protocol::kDefaultWindow - outstanding_, left_);
    if (wish < protocol::kDefaultWindow / 4 && wish < left_) return 0;
    left_ -= wish;
    outstanding_ += wish;
    return wish;
  }
  bool spend(std::uint64_t cost) {  // false: the server sent more than it was granted
    if (cost > outstanding_) return false;
    outstanding_ -= cost;
    return true;
  }
  [[nodiscard]] bool exhausted() const { return left_ == 0 && outstanding_ < protocol::kMinCredit; }  // nothing more will come

 private:
  std::uint64_t left_;
  std::uint64_t outstanding_ = 0;
};

class Fetch {
 public:
  Fetch(ServerUrl url, const FetchOptions& options, Clock::time_point start, StreamConnection connection)
      : url_(std::move(url)), options_(options), start_(start), connection_(std::move(connection)) {}

  Result<void> open();
  Result<void> run(const std::function<void(const StreamClient&, const FetchFigures&)>& on_batch);
  Fetched finish() &&;

 private:
  Result<void> apply(const protocol::Batch& batch);
  Result<void> grant();
  tl::unexpected<Error> nonsense(const std::string& what) const { return fail("the server at " + url_.authority() + " sent nonsense: " + what); }
  [[nodiscard]] double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  void note_first_mesh() {
    if (figures_.seconds_first_mesh == 0 && client_->tet_count() > 0) figures_.seconds_first_mesh = elapsed();
  }

  ServerUrl url_;
  const FetchOptions& options_;
  Clock::time_point start_;
  StreamConnection connection_;
  std::optional<StreamClient> client_;
  Grants grants_{0};
  std::uint64_t sequence_ = 0;
  FetchFigures figures_;
};

// Open, View and the first grant go out together, to save a round trip; with a budget, the grant waits until it is known what Opened took of it.
Result<void> Fetch::open() {
  const bool unlimited = !options_.max_bytes;
  if (unlimited) grants_ = Grants(UINT64_MAX);
  const protocol::Open open{url_.name, "intervale-client " INTERVALE_VERSION, unlimited ? grants_.take() : 0};
  if (auto sent = connection_.send(open); !sent) return sent;
  if (auto sent = connection_.send(protocol::View{kEpoch, options_.lod}); !sent) return sent;
  auto answer = connection_.receive();
  if (!answer) return tl::unexpected(answer.error());
  auto* opened = std::get_if<protocol::Opened>(&*answer);
  if (opened == nullptr) return nonsense("something else than the data set's description");
  auto client = StreamClient::start(std::move(opened->description), options_.lod.max_tets);
  if (!client) return nonsense(client.error().message);
  client_ = std::move(*client);
  note_first_mesh();
  if (unlimited) return {};
  const std::uint64_t taken = connection_.bytes_received() + kDoneBytes;
  grants_ = Grants(*options_.max_bytes > taken ? *options_.max_bytes - taken : 0);
  return grant();
}

Result<void> Fetch::run(const std::function<void(const StreamClient&, const FetchFigures&)>& on_batch) {
  while (!client_->over_budget() && !grants_.exhausted()) {
    const auto message = connection_.receive();
    if (!message) return tl::unexpected(message.error());
    figures_.bytes_received = connection_.bytes_received();
    figures_.messages = connection_.messages();
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
    on_batch(*client_, figures_);
  }
  return {};
}

Result<void> Fetch::apply(const protocol::Batch& batch) {
  if (batch.sequence != sequence_++ || batch.epoch != kEpoch) return nonsense("a batch that is out of order");
  if (!grants_.spend(protocol::cost_of(batch))) return nonsense("more than it was granted");
  const std::uint64_t before = client_->updates();
  if (auto applied = client_->apply(batch.payload); !applied) return nonsense(applied.error().message);
  if (!client_->over_budget() && client_->updates() - before != batch.updates) return nonsense("a batch of another size than it says");
  note_first_mesh();
  figures_.remaining_error = batch.remaining_error;
  figures_.remaining_pixels = batch.remaining_pixels;
  figures_.updates_to_go = batch.updates_to_go;
  return grant();
}

Result<void> Fetch::grant() {
  const std::uint64_t bytes = grants_.take();
  if (bytes == 0) return {};
  return connection_.send(protocol::Credit{bytes});
}

Fetched Fetch::finish() && {
  figures_.bytes_received = connection_.bytes_received();
  figures_.messages = connection_.messages();
  figures_.seconds = elapsed();
  connection_.close();
  return {std::move(*client_), figures_};
}

}  // namespace

Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options,
                      const std::function<void(const StreamClient&, const FetchFigures&)>& on_batch) {
  if (auto ok = check_lod(options.lod); !ok) return tl::unexpected(ok.error());
  const auto start = Clock::now();
  auto connection = StreamConnection::open(url);
  if (!connection) return tl::unexpected(connection.error());
  Fetch stream(url, options, start, std::move(*connection));
  if (auto opened = stream.open(); !opened) return tl::unexpected(opened.error());
  if (auto run = stream.run(on_batch); !run) return tl::unexpected(run.error());
  return std::move(stream).finish();
}

}  // namespace intervale
