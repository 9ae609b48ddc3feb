// Two coroutines a session: the reader takes messages and measures, the writer sends credit and views as they are due, and alone closes. A client has
// one session after the other, as long as servers are lost and found again.
#include "client/load/load_client.h"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/core/backoff.h"
#include "client/core/grants.h"
#include "client/net/connection.h"
#include "client/net/line.h"
#include "protocol/codec.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using protocol::CloseCode;
using Time = LoadClock::time_point;

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);

double milliseconds(LoadClock::duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

std::uint64_t seed_of(std::uint64_t run, unsigned client) { return std::uint64_t(random_fraction(run, client) * 0x1p53); }

// Close codes after which another server, or this one later, may go on.
bool is_to_be_found_again(unsigned code) {
  return code == static_cast<unsigned>(CloseCode::going_away) || code == static_cast<unsigned>(CloseCode::internal);
}

// A view whose answer is waited for.
struct Pending {
  std::uint64_t epoch = 0;
  Time due;
  std::uint64_t stale_bytes = 0;
};

class LoadClient {
 public:
  LoadClient(asio::io_context& io, const tcp::resolver::results_type& endpoints, const LoadPlan& plan, unsigned number, LoadFigures& figures,
             LoadProgress& progress)
      : io_(io),
        ws_(std::in_place, io),
        wake_(io),
        line_(io),
        endpoints_(endpoints),
        plan_(plan),
        path_(plan.path),
        start_(plan.start + plan.ramp * number / plan.clients),
        grants_(UINT64_MAX, plan.window),
        figures_(figures),
        progress_(progress) {
    path_.seed = seed_of(plan.path.seed, number);
  }
  LoadClient(const LoadClient&) = delete;
  LoadClient& operator=(const LoadClient&) = delete;

  asio::awaitable<void> run();
  void end_views();  // the duration is over: no new views; closes once all are answered
  void leave();      // closes

  // After run().
  std::optional<StreamClient> take_mesh() { return std::move(mesh_); }

 private:
  asio::awaitable<bool> connect();
  asio::awaitable<bool> find_again();
  asio::awaitable<void> converse();
  asio::awaitable<void> read_messages();
  asio::awaitable<void> write_messages();
  asio::awaitable<bool> greet();
  asio::awaitable<bool> send(const protocol::ClientMessage& message);
  asio::awaitable<void> pass_line(std::size_t bytes);
  void receive(std::size_t size);
  void look();
  void give_up(std::uint64_t epoch);
  void take(protocol::Opened opened);
  void take(const protocol::Batch& batch);
  void take(const protocol::Done& done);
  void take(const protocol::Fault& fault);
  void note_mesh();
  void serve(std::uint64_t epoch);
  void close_if_answered();
  void lost(beast::error_code error);
  void lose(const std::string& what);
  void fail(const std::string& what);
  void cut_off();
  void report_rest();
  [[nodiscard]] Time due(std::uint64_t view) const {
    return first_view_ + std::chrono::duration_cast<LoadClock::duration>(std::chrono::duration<double>(double(view) / path_.views_per_second));
  }
  [[nodiscard]] protocol::View view();
  [[nodiscard]] std::optional<protocol::View> due_view();

  asio::io_context& io_;
  std::optional<websocket::stream<Stream>> ws_;  // never empty; another one for each session
  beast::flat_buffer buffer_;
  asio::steady_timer wake_;  // the writer sleeps on it
  asio::steady_timer line_;  // the reader does, where the rate is limited
  const tcp::resolver::results_type& endpoints_;
  const LoadPlan& plan_;
  CameraPath path_;
  Time start_;       // when it is to connect
  Time first_view_;  // when the WebSocket was opened
  Time now_;         // when the message that is looked at had come
  Time line_free_{};
  Grants grants_;
  Time asked_;  // when Open was sent
  LoadFigures& figures_;
  LoadProgress& progress_;
  std::optional<StreamClient> mesh_;
  std::uint64_t least_tets_ = 0;  // of the mesh without any update: no budget makes it smaller
  std::deque<Pending> pending_;
  std::uint64_t credit_due_ = 0;  // granted, and still to be sent
  std::uint64_t view_ = 0;        // number of the last one asked for; its epoch is one more
  std::uint64_t epoch_ = 0;       // of the last message
  std::uint64_t sequence_ = 0;    // of the next batch
  std::uint64_t updates_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t received_ = 0;   // updates, in all sessions
  std::uint64_t forgotten_ = 0;  // of those
  std::string complaint_;        // why there is no connection
  std::optional<Time> lost_at_;  // when the server was seen to be lost, until another has served a view
  bool connected_ = false;
  bool opened_ = false;
  bool has_mesh_ = false;    // or knows that none will come
  bool done_ = false;        // all of the last view has come
  bool full_ = false;        // ... that there is room for
  bool views_over_ = false;  // no more views are sent
  bool closing_ = false;     // what comes counts no more
  bool gone_ = false;        // the connection is over
  bool lost_ = false;        // ... and another is looked for
  bool over_ = false;        // ... and none is
  bool failed_ = false;
};

asio::awaitable<void> LoadClient::run() {
  wake_.expires_at(start_);
  co_await wake_.async_wait(kAwait);
  if (co_await connect()) {
    ++figures_.connected;
    first_view_ = LoadClock::now();
    if (path_.scenario == Scenario::full) pending_.push_back({1, first_view_});
    ++figures_.views;
    co_await converse();
    while (lost_) {
      const bool found = co_await find_again();
      if (!found) break;
      co_await converse();
    }
  } else {
    fail(complaint_);
  }
  report_rest();
}

asio::awaitable<bool> LoadClient::connect() {
  auto& stream = beast::get_lowest_layer(*ws_);
  // Until the WebSocket's own deadlines hold.
  asio::steady_timer deadline(io_, plan_.patience);
  deadline.async_wait([&stream](beast::error_code error) {
    if (!error) stream.close();
  });
  if (const auto [error, endpoint] = co_await asio::async_connect(stream.socket(), endpoints_, kAwait); error) {
    complaint_ = "cannot connect to " + plan_.url.authority() + ": " + error.message();
    co_return false;
  }
  beast::error_code ignored;
  stream.socket().set_option(tcp::no_delay(true), ignored);
  if (plan_.tls) {
    stream.use_tls(plan_.tls, plan_.url.host);
    if (const auto [error] = co_await stream.async_handshake(kAwait); error) {
      complaint_ = tls_failure(stream, plan_.url, error);
      co_return false;
    }
  }
  deadline.cancel();
  ws_->set_option(websocket::stream_base::timeout{plan_.patience, kSilenceTime, true});
  ws_->set_option(websocket::stream_base::decorator([this](websocket::request_type& request) {
    if (plan_.url.access.token) request.set(http::field::authorization, "Bearer " + *plan_.url.access.token);
    request.set(http::field::user_agent, "intervale-load/" INTERVALE_VERSION);
    request.set(http::field::sec_websocket_protocol, protocol::kSubprotocol);
  }));
  ws_->read_message_max(protocol::kMaxServerMessage);
  ws_->auto_fragment(false);
  ws_->binary(true);
  if (const auto [error] = co_await ws_->async_handshake(plan_.url.authority(), protocol::kPath, kAwait); error) {
    complaint_ = "no WebSocket to " + plan_.url.authority() + ": " + error.message();
    co_return false;
  }
  co_return true;
}

// Another connection, with a session still to begin. False: the time for that is over, or the client's.
asio::awaitable<bool> LoadClient::find_again() {
  const Time deadline = LoadClock::now() + *plan_.reconnect;
  const std::string why = complaint_;
  Backoff backoff(path_.seed);
  while (!over_) {
    const Time next = LoadClock::now() + backoff.next();
    if (next > deadline) {
      fail(why);
      break;
    }
    wake_.expires_at(next);
    co_await wake_.async_wait(kAwait);
    if (over_) break;
    ws_.emplace(io_);
    gone_ = lost_ = opened_ = done_ = false;
    sequence_ = credit_due_ = 0;
    grants_.forget_outstanding();
    if (co_await connect()) {
      ++figures_.reconnects;
      co_return true;
    }
  }
  co_return false;
}

asio::awaitable<void> LoadClient::converse() {
  using namespace asio::experimental::awaitable_operators;
  connected_ = true;
  ++progress_.connected;
  co_await (read_messages() && write_messages());
  --progress_.connected;
  connected_ = false;
}

// Open, the first grant, what the client has, and a view go out together, to save a round trip. Messages have names: g++ 12 destroys temporaries in a
// co_await twice.
asio::awaitable<bool> LoadClient::greet() {
  protocol::Open open{plan_.url.name, "intervale-load " INTERVALE_VERSION, grants_.take_all(), {}};
  std::vector<SlotGroup> splits;
  if (mesh_) {
    open.resume = plan_.description.content_hash;
    splits = mesh_->resume();
  }
  asked_ = LoadClock::now();
  const protocol::ClientMessage opening = open;
  if (!co_await send(opening)) co_return false;
  for (std::size_t first = 0; first < splits.size(); first += protocol::kMaxHave) {
    const auto some = splits.begin() + std::ptrdiff_t(first);
    const auto end = some + std::ptrdiff_t(std::min(protocol::kMaxHave, splits.size() - first));
    const protocol::ClientMessage have = protocol::Have{{some, end}};
    figures_.resume_bytes += protocol::encode(have).size();
    if (!co_await send(have)) co_return false;
  }
  const auto newer = due_view();
  const protocol::ClientMessage first = newer ? *newer : view();
  const bool sent = co_await send(first);
  co_return sent;
}

asio::awaitable<void> LoadClient::write_messages() {
  if (!co_await greet()) co_return;
  while (!gone_) {
    if (closing_) {
      co_await ws_->async_close(websocket::close_code::normal, kAwait);  // within the plan's patience; an error is a server that left first
      co_return cut_off();
    }
    if (const std::uint64_t bytes = std::exchange(credit_due_, 0); bytes != 0) {
      const protocol::ClientMessage credit = protocol::Credit{bytes};
      if (!co_await send(credit)) co_return;
    } else if (const auto view = due_view()) {
      const protocol::ClientMessage message = *view;
      if (!co_await send(message)) co_return;
    } else {
      wake_.expires_at(path_.scenario == Scenario::full || views_over_ ? Time::max() : due(view_ + 1));
      co_await wake_.async_wait(kAwait);
    }
  }
}

asio::awaitable<bool> LoadClient::send(const protocol::ClientMessage& message) {
  const auto bytes = protocol::encode(message);
  const auto [error, size] = co_await ws_->async_write(asio::buffer(bytes), kAwait);
  if (error) lost(error);
  co_return !error;
}

// The last one asked for, to be sent.
protocol::View LoadClient::view() {
  protocol::View view{view_ + 1, view_of(path_, view_)};
  if (plan_.budget.max_updates != UINT64_MAX) view.room = plan_.budget.max_updates;
  if (mesh_) view.forget = mesh_->give_up(view.epoch, protocol::kMaxHave);
  return view;
}

// The newest view that is due. Where several are, those before it are as good as sent: their answer is waited for all the same.
std::optional<protocol::View> LoadClient::due_view() {
  if (path_.scenario == Scenario::full || views_over_) return {};
  const Time now = LoadClock::now();
  if (due(view_ + 1) > now) return {};
  for (Time next = due(view_ + 1); next <= now; next = due(view_ + 1)) {
    ++view_;
    ++figures_.views;
    if (now - next > kLate) ++figures_.late_views;
    pending_.push_back({view_ + 1, next});
  }
  done_ = false;
  look();
  return view();
}

asio::awaitable<void> LoadClient::read_messages() {
  while (!gone_) {
    buffer_.clear();
    const auto [error, size] = co_await ws_->async_read(buffer_, kAwait);
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
  if (ws_->got_text()) return fail("the server sent text");
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
  if (std::exchange(opened_, true)) return fail("the server sent nonsense: a second description");
  grants_.round_trip(now_ - asked_);
  if (opened.description.content_hash != plan_.description.content_hash) return fail("the server sent nonsense: another volume than before");
  if (mesh_) {
    if (!opened.resumed) return fail("the server sent nonsense: it has the same volume, and does not resume");
    figures_.repeated_bytes += buffer_.size();
    return;
  }
  if (!plan_.verify) return;
  auto client = StreamClient::start(std::move(opened.description), plan_.budget);
  if (!client) return fail("the server sent nonsense: " + client.error().message);
  mesh_ = std::move(*client);
  least_tets_ = mesh_->tet_count();
  look();
}

// A mesh with a budget keeps what matters most from where it is seen.
void LoadClient::look() {
  const auto camera = view_of(path_, view_).camera;
  if (mesh_ && camera) mesh_->look(*camera);
}

// The answer to a view has come: what that was to forget is gone.
void LoadClient::give_up(std::uint64_t epoch) {
  if (!mesh_) return;
  mesh_->arrived(epoch);
  forgotten_ += updates_ - mesh_->updates();
  updates_ = mesh_->updates();
}

void LoadClient::take(const protocol::Batch& batch) {
  if (!opened_ || batch.sequence != sequence_++ || batch.epoch < std::max<std::uint64_t>(epoch_, 1) || batch.epoch > view_ + 1) {
    return fail("the server sent nonsense: a batch that is out of order");
  }
  if (!grants_.spend(protocol::cost_of(batch))) return fail("the server sent nonsense: more than it was granted");
  epoch_ = batch.epoch;
  give_up(batch.epoch);
  updates_ += batch.updates;
  received_ += batch.updates;
  if (now_ <= plan_.end()) {
    figures_.updates += batch.updates;
    progress_.updates += batch.updates;
  }
  serve(batch.epoch);
  for (Pending& view : pending_) view.stale_bytes += buffer_.size();
  if (mesh_) {
    auto applied = mesh_->apply(batch.payload, batch.epoch);
    if (applied && mesh_->updates() != updates_) applied = intervale::fail("a batch of another size than it says");
    if (applied && mesh_->tet_count() > std::max(plan_.budget.max_tets, least_tets_)) applied = intervale::fail("a mesh over its budget");
    if (!applied) {
      mesh_.reset();  // it must not be used again
      return fail("the server sent nonsense: " + applied.error().message);
    }
    now_ = LoadClock::now();
  }
  if (batch.updates > 0 && (!mesh_ || mesh_->tet_count() > 0)) note_mesh();
  close_if_answered();
  grants_.applied(protocol::cost_of(batch), now_);
  while (const std::uint64_t bytes = grants_.take()) credit_due_ += bytes;
  if (credit_due_ != 0) wake_.cancel();
}

void LoadClient::take(const protocol::Done& done) {
  if (!opened_ || done.epoch < std::max<std::uint64_t>(epoch_, 1) || done.epoch > view_ + 1) {
    return fail("the server sent nonsense: an end that is out of order");
  }
  give_up(done.epoch);
  if (done.updates_sent != updates_) return fail("the server sent nonsense: the end of the stream, with updates missing");
  epoch_ = done.epoch;
  ++figures_.done_views;
  has_mesh_ = true;  // if it has none, there is none
  done_ = done.epoch == view_ + 1;
  full_ = done.full;
  grants_.pause();
  serve(done.epoch);
  if (path_.scenario == Scenario::full) return leave();
  close_if_answered();
}

void LoadClient::take(const protocol::Fault& fault) {
  std::string text = fault.text;
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';  // it goes to a terminal
  }
  ++figures_.protocol_closes;
  const std::string what = "the server ended the session: " + text + " (code " + std::to_string(static_cast<unsigned>(fault.code)) + ")";
  if (is_to_be_found_again(static_cast<unsigned>(fault.code))) return lose(what);
  fail(what);
}

void LoadClient::note_mesh() {
  if (std::exchange(has_mesh_, true)) return;
  figures_.first_mesh_ms.push_back(milliseconds(now_ - start_));
  figures_.first_mesh_bytes.push_back(double(bytes_));
}

// Views up to this epoch are answered.
void LoadClient::serve(std::uint64_t epoch) {
  if (lost_at_) figures_.resume_ms.push_back(milliseconds(now_ - *std::exchange(lost_at_, {})));
  for (; !pending_.empty() && pending_.front().epoch <= epoch; pending_.pop_front()) {
    figures_.view_change_ms.push_back(milliseconds(now_ - pending_.front().due));
    if (pending_.front().epoch > 1) figures_.stale_bytes.push_back(double(pending_.front().stale_bytes));  // the first one replaces none
  }
}

void LoadClient::end_views() {
  views_over_ = true;
  close_if_answered();
}

void LoadClient::close_if_answered() {
  if (views_over_ && pending_.empty() && has_mesh_) leave();
}

void LoadClient::leave() {
  closing_ = true;
  if (!connected_ && !over_) fail(lost_at_ ? complaint_ + ", and not found again before the end" : "not connected before the end");
  wake_.cancel();
  line_.cancel();
}

// The connection is over. In order, if it was to be.
void LoadClient::lost(beast::error_code error) {
  if (closing_ || gone_) return cut_off();
  if (error != websocket::error::closed) return lose("lost the server: " + error.message());
  ++figures_.protocol_closes;
  const std::string what = "the server closed the session with code " + std::to_string(ws_->reason().code);
  if (is_to_be_found_again(ws_->reason().code)) return lose(what);
  fail(what);
}

// There may be another server.
void LoadClient::lose(const std::string& what) {
  if (!plan_.reconnect) return fail(what);
  complaint_ = what;
  if (!lost_at_) lost_at_ = LoadClock::now();
  lost_ = true;
  cut_off();
}

void LoadClient::fail(const std::string& what) {
  if (over_) return;
  over_ = true;
  failed_ = true;
  ++figures_.failed;
  ++figures_.errors[what];
  cut_off();
}

void LoadClient::cut_off() {
  gone_ = true;
  beast::get_lowest_layer(*ws_).close();
  wake_.cancel();
  line_.cancel();
}

// What was still waited for counts with its time so far; a client that failed says so, and its times would be shorter than the truth.
void LoadClient::report_rest() {
  figures_.unanswered_views += pending_.size();
  if (mesh_) figures_.repeated_updates += received_ - forgotten_ - mesh_->updates();
  if (failed_) return;
  if (done_ && !full_) ++figures_.complete;
  now_ = LoadClock::now();
  if (!has_mesh_) figures_.first_mesh_ms.push_back(milliseconds(now_ - start_));
  if (!pending_.empty() || lost_at_) serve(UINT64_MAX);
}

asio::awaitable<void> end_in_time(asio::steady_timer& timer, const LoadPlan& plan, std::vector<std::unique_ptr<LoadClient>>& clients) {
  timer.expires_at(plan.end());
  if (const auto [error] = co_await timer.async_wait(kAwait); error) co_return;  // all have ended already
  for (const auto& client : clients) {
    if (client) client->end_views();
  }
  timer.expires_at(plan.end() + kGrace);
  if (const auto [error] = co_await timer.async_wait(kAwait); error) co_return;
  for (const auto& client : clients) {
    if (client) client->leave();
  }
}

}  // namespace

LoadFigures run_clients(const LoadPlan& plan, unsigned first, unsigned step, std::span<std::optional<StreamClient>> meshes, LoadProgress& progress) {
  asio::io_context io(1);
  const auto endpoints = tcp::resolver(io).resolve(plan.url.host, plan.url.port);
  LoadFigures figures;
  std::vector<std::unique_ptr<LoadClient>> clients;
  for (unsigned number = first; number < plan.clients; number += step) {
    clients.push_back(std::make_unique<LoadClient>(io, endpoints, plan, number, figures, progress));
  }
  asio::steady_timer end(io);
  std::size_t running = clients.size();
  std::exception_ptr failure;
  for (std::size_t i = 0; i < clients.size(); ++i) {
    asio::co_spawn(io, clients[i]->run(), [&, i](const std::exception_ptr& thrown) {
      if (thrown) failure = thrown;
      if (plan.verify) meshes[first + i * step] = clients[i]->take_mesh();
      clients[i].reset();  // a WebSocket that was cut off keeps its timer running, and with it the io_context, for as long as it is there
      if (--running == 0) end.cancel();
    });
  }
  asio::co_spawn(io, end_in_time(end, plan, clients), [&](const std::exception_ptr& thrown) {
    if (thrown) failure = thrown;
  });
  io.run();
  if (failure) std::rethrow_exception(failure);
  return figures;
}

}  // namespace intervale
