#include "client/api/live_mesh.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "client/api/data_set_url.h"
#include "client/core/client_session.h"
#include "client/core/reconnecting.h"
#include "client/net/connection.h"
#include "common/api/describe_data_set.h"

namespace intervale {
namespace {

using Clock = ClientSession::Clock;

ViewRequest view_of(const MeshRequest& request, const LiveMeshOptions& options) {
  ViewRequest view{.lod = request.lod,
                   .camera = request.lod.camera,
                   .budget = {.max_tets = request.lod.max_tets.value_or(UINT64_MAX)},
                   .shown = request.shown,
                   .early = true,
                   .channels = request.channels};
  if (options.prefetch_ranges) view.coarse_error_percent = kCoarseErrorPercent;
  return view;
}

// Whether the data set has all of it.
Result<void> check_has(const Description& description, const MeshRequest& request) {
  if (description.has_every_range && request.shown.ranges.empty()) return misuse("'" + description.name + "' has every range: say which");
  if (auto held = check_held(description, resolve(description, request.shown)); !held) return held;
  const auto channels = find_channels(description.channels, request.channels);
  if (!channels) return tl::unexpected(channels.error());
  return {};
}

}  // namespace

// The thread of the connection, and what it shares with the others.
class LiveMesh::Worker {
 public:
  Worker(ServerUrl url, const MeshRequest& request, const LiveMeshOptions& options)
      : url_(std::move(url)),
        options_(options),
        session_({.dataset = url_.name, .client = "intervale-client " INTERVALE_VERSION, .server = "the server at " + url_.authority()}),
        reconnecting_(options.reconnect),
        request_(request),
        thread_([this] { run(); }) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() {
    change([this] { is_ending_ = true; });
    thread_.join();
  }

  Result<void> wait_for_description() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return description_ || error_; });
    if (error_) return tl::unexpected(*error_);
    return {};
  }

  DataSetInfo info() {
    const std::lock_guard lock(mutex_);
    return info_of(*description_);
  }

  Result<void> look(const MeshRequest& request) {
    if (auto valid = check_request(request); !valid) return valid;
    std::optional<Description> description;
    {
      const std::lock_guard lock(mutex_);
      description = description_;
    }
    if (auto has = check_has(*description, request); !has) return has;
    change([&] {
      request_ = request;
      is_looking_ = true;
      state_.reset();  // it answers the last request
    });
    return {};
  }

  Result<std::optional<MeshState>> wait(std::chrono::milliseconds time) {
    if (time.count() > 0) change([this] { ++waiting_; });
    std::unique_lock lock(mutex_);
    if (time.count() > 0) {
      changed_.wait_for(lock, time, [this] { return state_ || error_; });
      --waiting_;
    }
    if (error_ && !state_) return tl::unexpected(*error_);
    auto state = std::exchange(state_, {});
    if (!state) {
      is_polled_ = true;
      if (connection_) connection_->wake();
    }
    return state;
  }

 private:
  // Changes what is shared, and wakes the thread.
  template <class Change>
  void change(const Change& what) {
    {
      const std::lock_guard lock(mutex_);
      what();
      if (connection_) connection_->wake();
    }
    changed_.notify_all();
  }

  void run() {
    const Result<void> end = converse();
    const std::lock_guard lock(mutex_);
    if (!end) error_ = end.error();
    changed_.notify_all();
  }

  // Over one connection after the other.
  Result<void> converse() {
    std::optional<Error> lost;
    while (!is_ending()) {
      auto connection = StreamConnection::open(url_);
      if (!connection) {
        if (!lost) return tl::unexpected(connection.error());
      } else {
        auto stream = receive_all(*connection);
        if (stream || !session_.mesh() || !was_lost_ || options_.reconnect.count() == 0) return stream;
        session_.disconnected();
        lost = stream.error();
        reconnecting_.lost();
      }
      const auto pause = reconnecting_.pause();
      if (!pause) return tl::unexpected(*lost);
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, *pause, [this] { return is_ending_; });
    }
    return {};
  }

  Result<void> receive_all(StreamConnection& connection) {
    {
      const std::lock_guard lock(mutex_);
      connection_ = &connection;
    }
    auto received = receive_until_end(connection);
    was_lost_ = !received && connection.is_lost();
    {
      const std::lock_guard lock(mutex_);
      connection_ = nullptr;
    }
    if (received) connection.close();
    return received;
  }

  Result<void> receive_until_end(StreamConnection& connection) {
    if (auto looked = take_request(); !looked) return looked;
    session_.connected(Clock::now());
    reconnecting_.connected();
    if (auto sent = connection.send(session_); !sent) return sent;
    while (!is_ending()) {
      if (auto looked = take_request(); !looked) return looked;
      if (auto sent = connection.send(session_); !sent) return sent;
      const bool is_late = make_state();
      const auto event = connection.receive(session_, is_late ? next_state() : Clock::time_point::max());
      if (!event) return tl::unexpected(event.error());
      reconnecting_.received(*event);
      if (event->kind == ClientSession::Event::Kind::opened) {
        if (auto opened = take_description(); !opened) return opened;
      }
      if (event->kind == ClientSession::Event::Kind::batch || event->kind == ClientSession::Event::Kind::done) set_changed();
    }
    return {};
  }

  Result<void> take_description() {
    const std::lock_guard lock(mutex_);
    if (auto has = check_has(*session_.description(), request_); !has) return has;
    description_ = *session_.description();
    changed_.notify_all();
    return {};
  }

  // The last look(), if it was not passed on yet.
  Result<void> take_request() {
    MeshRequest request;
    {
      const std::lock_guard lock(mutex_);
      if (!std::exchange(is_looking_, false)) return {};
      request = request_;
    }
    if (session_.mesh()) set_changed();
    ViewRequest view = view_of(request, options_);
    if (view.camera) view.ahead = motion_.next(*view.camera, Clock::now());
    return session_.look(std::move(view));
  }

  void set_changed() {
    is_changed_ = true;
    changed_at_ = Clock::now();
  }

  // When there is time for a mesh: most of it is for what arrives, but if nothing does, a mesh delays nothing.
  [[nodiscard]] Clock::time_point next_state() const { return std::min(made_at_ + 9 * cost_, changed_at_ + cost_); }

  // Makes the mesh if it changed, somebody asks, and there is time. True: only time is missing, until next_state().
  bool make_state() {
    const bool is_done = session_.state() == ClientSession::State::idle;
    if (!session_.mesh() || !is_changed_) return false;
    {
      const std::lock_guard lock(mutex_);
      if (waiting_ == 0 && !is_polled_) return false;
      if (!is_done && Clock::now() < next_state()) return true;
      is_polled_ = false;
    }
    const auto begin = Clock::now();
    const ClientSession::Stats& stats = session_.stats();
    MeshState state{.mesh = std::make_shared<const Mesh>(session_.mesh()->mesh()),
                    .is_done = is_done,
                    .remaining_error = stats.remaining_error,
                    .remaining_pixels = stats.remaining_pixels,
                    .updates = session_.mesh()->updates(),
                    .bytes = stats.bytes};
    made_at_ = Clock::now();
    cost_ = made_at_ - begin;
    is_changed_ = false;
    const std::lock_guard lock(mutex_);
    if (!is_looking_) state_ = std::move(state);
    changed_.notify_all();
    return false;
  }

  bool is_ending() {
    const std::lock_guard lock(mutex_);
    return is_ending_;
  }

  // Of the thread alone.
  const ServerUrl url_;
  const LiveMeshOptions options_;
  ClientSession session_;
  CameraMotion motion_;
  bool was_lost_ = false;
  Reconnecting reconnecting_;
  bool is_changed_ = false;         // the mesh, since the last state
  Clock::time_point changed_at_{};  // when it changed last
  Clock::time_point made_at_{};     // the last state
  Clock::duration cost_{};          // how long that took

  std::mutex mutex_;
  std::condition_variable changed_;
  MeshRequest request_;                     // the last one
  bool is_looking_ = true;                  // ... and it was not passed on yet
  bool is_ending_ = false;                  // the thread is to end
  bool is_polled_ = false;                  // somebody asked for a state, and there was none
  int waiting_ = 0;                         // how many wait for one
  StreamConnection* connection_ = nullptr;  // the one that may be woken
  std::optional<Description> description_;
  std::optional<MeshState> state_;  // not taken yet
  std::optional<Error> error_;      // the stream has ended

  std::thread thread_;  // last: it uses the others
};

LiveMesh::LiveMesh(std::unique_ptr<Worker> worker) : worker_(std::move(worker)) {}
LiveMesh::LiveMesh(LiveMesh&&) noexcept = default;
LiveMesh& LiveMesh::operator=(LiveMesh&&) noexcept = default;
LiveMesh::~LiveMesh() = default;

Result<LiveMesh> LiveMesh::connect(std::string_view text, const MeshRequest& request, const LiveMeshOptions& options) {
  auto url = parse_data_set_url(text, options.access);
  if (!url) return tl::unexpected(url.error());
  if (auto valid = check_request(request); !valid) return tl::unexpected(valid.error());
  auto worker = std::make_unique<Worker>(std::move(*url), request, options);
  if (auto described = worker->wait_for_description(); !described) return tl::unexpected(described.error());
  return LiveMesh(std::move(worker));
}

DataSetInfo LiveMesh::info() const { return worker_->info(); }
Result<void> LiveMesh::look(const MeshRequest& request) { return worker_->look(request); }
Result<std::optional<MeshState>> LiveMesh::poll() { return worker_->wait(std::chrono::milliseconds(0)); }
Result<std::optional<MeshState>> LiveMesh::wait(std::chrono::milliseconds time) { return worker_->wait(time); }

}  // namespace intervale
