// Two coroutines on one strand. The reader passes messages to the session state; the writer sends the messages that
// the state has next, and is the only one to close the WebSocket. A batch is selected only when the message before is
// sent, so a slow client costs the memory of one message, and no time of other sessions.
#include "server/serve/websocket_session.h"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>
#include <string>
#include <utility>

#include "protocol/codec.h"
#include "protocol/transport/await.h"
#include "server/serve/admission.h"
#include "server/serve/log.h"
#include "server/serve/session_threads.h"
#include "server/serve/thread_time.h"
#include "server/serve/view_timing.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using protocol::CloseCode;
using protocol::Fault;
using Clock = std::chrono::steady_clock;
using Request = http::request<http::empty_body>;

constexpr std::chrono::seconds kMaxPingBacklog{1};  // how far pings may exceed the message rate
// Work on messages that a session may do before it waits for a worker of the scheduler: credit and views take microseconds.
constexpr std::chrono::microseconds kMaxUnscheduled{200};
// What a fault of the client costs its account, so that breaking the rules again and again does not pay.
constexpr std::chrono::milliseconds kFaultCost{100};
// Work for a view that goes before that of other sessions: until its first message, but not for longer.
constexpr std::chrono::milliseconds kUrgentWork{10};
// A session that has all that its view wants, and gets no message for so long, rests (SessionState::rest()).
constexpr std::chrono::seconds kRest{2};
constexpr std::size_t kReadBuffer = 512;  // holds most messages of clients; grows for others
// Payloads while other sessions wait for a worker: the first of a view, and the others.
constexpr std::size_t kContendedFirstPayload = 1 << 10, kContendedPayload = 16 << 10;

bool breaks_rules(CloseCode code) {
  return code == CloseCode::text_frame || code == CloseCode::malformed || code == CloseCode::out_of_order || code == CloseCode::too_large;
}

class WebSocketSession : public Connection, public std::enable_shared_from_this<WebSocketSession> {
 public:
  WebSocketSession(Stream stream, ServerContext& context, Peer peer)
      : ws_(std::move(stream)),
        writer_wakeup_(ws_.get_executor()),
        write_deadline_(ws_.get_executor()),
        read_delay_(ws_.get_executor()),
        context_(context),
        peer_(std::move(peer)),
        threads_(context.ranges, context.background, peer_.account),
        state_(find_granted(context.catalogue, peer_.scope), threads_,
               context.options.on_demand ? SessionState::Growth::on_demand : SessionState::Growth::by_itself),
        flow_(peer_.account),
        messages_(context.options.messages_per_second),
        views_(context.options.views_per_second),
        id_(context.next_session_id++),
        memory_(context.memory, Memory::Holder::sessions, 0) {}
  WebSocketSession(const WebSocketSession&) = delete;
  WebSocketSession& operator=(const WebSocketSession&) = delete;

  ~WebSocketSession() override {
    context_.metrics.count_close(close_code_);  // first: who finds no session any more finds how they ended
    context_.metrics.connections.Decrement();
    if (peer_.scope) context_.metrics.sessions.Decrement();
    log_session(id_, spdlog::level::info, "closed: dataset '{}', {} updates, {} bytes, code {}{}", state_.dataset(), state_.updates_sent(),
                bytes_sent_, close_code_, close_note_.empty() ? "" : " (" + close_note_ + ")");
  }

  void start(const Request& request) {
    context_.metrics.connections.Increment();
    // A session that is only opened to be closed with 4401 does not count.
    if (peer_.scope) context_.metrics.sessions.Increment();
    context_.metrics.sessions_total.Increment();
    beast::error_code ignored;
    const auto endpoint = beast::get_lowest_layer(ws_).socket().remote_endpoint(ignored);
    log_session(id_, spdlog::level::info, "from {}:{}", endpoint.address().to_string(), endpoint.port());
    registration_ = context_.connections.add(shared_from_this());
    threads_.set_wake([weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->wake_writer();
    });
    spawn(run(shared_from_this(), request));
  }

  void begin_shutdown() override {
    asio::post(ws_.get_executor(), [self = shared_from_this()] { self->close({CloseCode::going_away, "the server shuts down"}); });
  }

  void catalogue_changed() override { wake_writer(); }

  void abort(const char* why) override {
    asio::post(ws_.get_executor(), [self = shared_from_this(), why] {
      if (self->close_note_.empty()) self->close_note_ = why;
      self->abort_connection();
    });
  }

 private:
  void wake_writer() {
    asio::post(ws_.get_executor(), [self = shared_from_this()] { self->writer_wakeup_.cancel(); });
  }

  void spawn(asio::awaitable<void> coroutine) {
    asio::co_spawn(ws_.get_executor(), std::move(coroutine), [self = shared_from_this()](const std::exception_ptr& failure) {
      if (failure) self->fail_with(failure);
    });
  }

  void fail_with(const std::exception_ptr& failure) {
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& exception) {
      close_note_ = exception.what();
    }
    close_code_ = static_cast<unsigned>(CloseCode::internal);
    abort_connection();
  }

  // Ends the session in order: the writer sends the fault and closes. The first fault counts.
  void close(Fault fault) {
    if (breaks_rules(fault.code)) context_.scheduler.charge(*peer_.account, kFaultCost);
    if (!fault_ && !closed_) fault_ = std::move(fault);
    writer_wakeup_.cancel();
    read_delay_.cancel();
  }

  // Ends the session at once.
  void abort_connection() {
    closed_ = true;
    beast::get_lowest_layer(ws_).close();
    writer_wakeup_.cancel();
    read_delay_.cancel();
  }

  // Ends once the session runs, with the request and what only the handshake needs.
  asio::awaitable<void> run(std::shared_ptr<WebSocketSession> self, Request request) {
    prepare();
    if (const auto [error] = co_await ws_.async_accept(request, kAwait); error) {
      close_note_ = error.message();
      co_return;
    }
    if (peer_.scope == nullptr) {
      context_.metrics.count_refusal(Refusal::token);
      close({CloseCode::unauthorized, "a valid token is required"});
    }
    open_deadline_ = Clock::now() + context_.options.handshake_time;
    spawn(write_messages(self));
    spawn(read_messages(self));
  }

  void prepare() {
    beast::error_code ignored;
    beast::get_lowest_layer(ws_).socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    ws_.set_option(websocket::stream_base::timeout{protocol::kHandshakeTime, context_.options.idle_time, true});
    ws_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(http::field::server, std::string(protocol::kServerName) + "/" INTERVALE_VERSION);
      response.set(http::field::sec_websocket_protocol, protocol::kSubprotocol);
    }));
    // Beast answers pings within async_read_some, so a flood of them cannot be slowed down. The callback does not
    // outlive the session: the session owns the stream.
    ws_.control_callback([this](websocket::frame_type kind, beast::string_view) {
      if (kind == websocket::frame_type::ping && messages_.take(Clock::now()) > kMaxPingBacklog) {
        close({CloseCode::too_large, "too many pings"});
      }
    });
    ws_.read_message_max(0);  // read_messages has its own limit, with its own close code
    ws_.auto_fragment(false);
    ws_.binary(true);
  }

  asio::awaitable<void> read_messages([[maybe_unused]] std::shared_ptr<WebSocketSession> self) {
    beast::flat_buffer buffer;
    Memory::Share buffered(context_.memory, Memory::Holder::sessions, 0);
    while (!fault_) {
      buffer.clear();
      if (buffer.capacity() > kReadBuffer) buffer.shrink_to_fit();  // after a larger message
      buffered.resize(buffer.capacity());
      do {
        const std::size_t room = std::min(protocol::kMaxClientMessage + 1 - buffer.size(), std::max(kReadBuffer, buffer.size()));
        const auto [error, size] = co_await ws_.async_read_some(buffer, room, kAwait);
        buffered.resize(buffer.capacity());
        if (error) {
          on_read_error(error);
          co_return;
        }
        if (ws_.got_text()) co_return close({CloseCode::text_frame, "text frames are not supported"});
        if (buffer.size() > protocol::kMaxClientMessage) co_return close({CloseCode::too_large, "message too large"});
      } while (!ws_.is_message_done());
      if (fault_) co_return;
      co_await throttle(messages_);
      const std::span bytes(static_cast<const std::uint8_t*>(buffer.data().data()), buffer.size());
      if (unscheduled_ >= kMaxUnscheduled) co_await acquire_to_read(FairScheduler::Priority::interactive);
      const auto message = decode(bytes);
      if (!message) co_return close({CloseCode::malformed, message.error().message});
      if (std::holds_alternative<protocol::View>(*message)) co_await throttle(views_);
      if (takes_long(*message)) {
        const bool resumes = std::holds_alternative<protocol::Have>(*message) && !timing_.has_view();
        co_await acquire_to_read(resumes ? FairScheduler::Priority::bulk : FairScheduler::Priority::interactive);
      }
      const ReadingWork work{*this};
      receive(*message);
    }
  }

  Result<protocol::ClientMessage> decode(std::span<const std::uint8_t> bytes) {
    const ReadingWork work{*this};
    return protocol::decode_client_message(bytes);
  }

  // Opening, resuming and forgetting take up to a millisecond.
  [[nodiscard]] bool takes_long(const protocol::ClientMessage& message) const {
    const auto* const view = std::get_if<protocol::View>(&message);
    return view != nullptr ? !view->forget.empty()
                           : std::holds_alternative<protocol::Open>(message) || std::holds_alternative<protocol::Have>(message);
  }

  // bulk: only for messages before the first view, since a flow has one such request at a time.
  asio::awaitable<void> acquire_to_read(FairScheduler::Priority priority) {
    const auto lane = co_await context_.scheduler.async_acquire(flow_, priority, asio::use_awaitable);
    reader_worker_ = {lane, priority};
  }

  // Work of the reader; releases the worker, if it has one.
  struct ReadingWork {
    WebSocketSession& session;
    FairScheduler::Time since = thread_time();
    ~ReadingWork() {
      session.unscheduled_ += thread_time() - since;
      const auto worker = std::exchange(session.reader_worker_, std::nullopt);
      if (worker)
        session.context_.scheduler.release(session.flow_, worker->first, worker->second, std::exchange(session.unscheduled_, Clock::duration(0)));
    }
  };

  // Delays the reader of a client that exceeds the rate: TCP then slows the client down.
  asio::awaitable<void> throttle(RateLimit& limit) {
    const auto time = limit.take(Clock::now());
    if (time == Clock::duration(0) || fault_ || closed_) co_return;
    read_delay_.expires_after(time);
    co_await read_delay_.async_wait(kAwait);
  }

  // Releases the worker that async_acquire() assigned.
  struct ScheduledWork {
    FairScheduler& scheduler;
    FairScheduler::Flow& flow;
    FairScheduler::Lane lane;
    FairScheduler::Priority priority;
    FairScheduler::Time since = thread_time();
    ~ScheduledWork() { scheduler.release(flow, lane, priority, thread_time() - since); }
  };

  void receive(const protocol::ClientMessage& message) {
    if (fault_ || closed_) return;
    if (!state_.needs_credit()) stalled_since_ = Clock::now();  // this message may change that
    log_message(message);
    // Checked again at Open, which is when a session takes memory: many upgrades may have passed the check before.
    if (std::holds_alternative<protocol::Open>(message) && context_.memory.is_full()) {
      context_.metrics.count_refusal(Refusal::memory);
      return close({CloseCode::going_away, "the server has no capacity for another session"});
    }
    if (auto fault = state_.receive(message)) return close(std::move(*fault));
    if (const auto* const open = std::get_if<protocol::Open>(&message)) {
      context_.connections.set_waiting(registration_, false);
      if (context_.options.on_demand) use_.emplace(context_.scale_demand, open->dataset);
    }
    memory_.resize(state_.memory_bytes());
    if (const auto* view = std::get_if<protocol::View>(&message)) timing_.on_view(view->epoch);
    if (state_.view_is_unanswered()) context_.scheduler.promote(flow_);
    writer_wakeup_.cancel();
  }

  void log_message(const protocol::ClientMessage& message) const {
    if (const auto* open = std::get_if<protocol::Open>(&message)) {
      log_session(id_, spdlog::level::debug, "opens '{}'{}, client '{}'", open->dataset, open->resume ? " to resume" : "", open->client);
    } else if (const auto* view = std::get_if<protocol::View>(&message)) {
      log_session(id_, spdlog::level::debug, "view {}", view->epoch);
    }
  }

  // The client closed the WebSocket, or the connection broke.
  void on_read_error(beast::error_code error) {
    if (error == websocket::error::closed) {
      if (close_code_ == 0) close_code_ = ws_.reason().code;
    } else if (close_note_.empty()) {
      close_note_ = error.message();
    }
    closed_ = true;
    writer_wakeup_.cancel();
  }

  asio::awaitable<void> write_messages([[maybe_unused]] std::shared_ptr<WebSocketSession> self) {
    while (!closed_) {
      if (fault_) co_return co_await close_with_fault();
      std::optional<protocol::ServerMessage> message;
      if (state_.has_work()) {
        const auto lane = co_await context_.scheduler.async_acquire(flow_, priority(), asio::use_awaitable);
        message = compute(lane);
      } else {
        message = state_.next();
      }
      if (message && std::holds_alternative<Fault>(*message)) {
        close(std::get<Fault>(*std::move(message)));
      } else if (message) {
        if (!co_await send(*message)) co_return abort_connection();
        stalled_since_ = Clock::now();
        if (const auto* batch = std::get_if<protocol::Batch>(&*message)) {
          context_.metrics.updates_sent_total.Increment(batch->updates);
          timing_.on_sent(batch->epoch, context_.metrics);
        } else if (const auto* done = std::get_if<protocol::Done>(&*message)) {
          timing_.on_sent(done->epoch, context_.metrics);
        }
        continue;
      }
      if (use_ && !use_->want(state_.lacks_scales() ? state_.volume().get() : nullptr))
        close({CloseCode::going_away, "the rest of the data set could not be read"});
      if (!fault_ && !state_.has_work()) co_await wait();
    }
  }

  [[nodiscard]] FairScheduler::Priority priority() const {
    const bool is_urgent = state_.view_is_unanswered() && timing_.work() < kUrgentWork;
    return is_urgent ? FairScheduler::Priority::interactive : FairScheduler::Priority::bulk;
  }

  // Selects the next message, and releases the worker.
  std::optional<protocol::ServerMessage> compute(FairScheduler::Lane lane) {
    const ScheduledWork work{context_.scheduler, flow_, lane, priority()};
    if (closed_ || fault_) return {};
    const bool has_waiters = context_.scheduler.has_waiters();
    auto message = state_.next(!has_waiters ? protocol::kMaxBatchPayload : state_.view_is_unanswered() ? kContendedFirstPayload : kContendedPayload);
    memory_.resize(state_.memory_bytes());
    const auto time = thread_time() - work.since;
    timing_.add_work(time);
    context_.metrics.observe_selection(time);
    return message;
  }

  // Until a message arrives, the client's time to send Open or Credit is over, or it is time to rest.
  asio::awaitable<void> wait() {
    auto deadline = Clock::time_point::max();
    if (!state_.opened()) deadline = open_deadline_;
    if (state_.needs_credit()) deadline = stalled_since_ + context_.options.stall_time;
    const bool may_rest = state_.may_rest();
    if (may_rest) deadline = Clock::now() + kRest;
    writer_wakeup_.expires_at(deadline);
    const auto [error] = co_await writer_wakeup_.async_wait(kAwait);
    if (error || Clock::now() < deadline) co_return;
    if (may_rest) {
      state_.rest();  // unless a message has arrived meanwhile
      memory_.resize(state_.memory_bytes());
    } else {
      close({CloseCode::timed_out, state_.opened() ? "no credit was granted in time" : "no Open was received in time"});
    }
  }

  asio::awaitable<bool> send(const protocol::ServerMessage& message) {
    const auto bytes = protocol::encode(message);
    write_deadline_.expires_after(context_.options.write_time);
    write_deadline_.async_wait([weak = weak_from_this()](beast::error_code error) {
      if (const auto self = weak.lock(); self && !error) self->abort_connection();
    });
    const Memory::Share queued(context_.memory, Memory::Holder::queues, 2 * bytes.size());  // encoded, and as `message`
    const auto reservation = context_.write_budget.reserve(weak_from_this(), bytes.size());
    const auto [error, size] = co_await ws_.async_write(asio::buffer(bytes), kAwait);
    write_deadline_.cancel();
    if (error) {
      if (close_note_.empty()) close_note_ = error.message();
      co_return false;
    }
    bytes_sent_ += bytes.size();
    context_.metrics.bytes_sent_total.Increment(double(bytes.size()));
    co_return true;
  }

  asio::awaitable<void> close_with_fault() {
    close_code_ = static_cast<unsigned>(fault_->code);
    close_note_ = fault_->text;
    if (fault_->code != CloseCode::going_away) context_.metrics.faults_total.Increment();
    const protocol::ServerMessage fault = *fault_;
    if (!co_await send(fault)) co_return abort_connection();
    const auto code = static_cast<websocket::close_code>(fault_->code);
    const websocket::close_reason reason(code, fault_->text);
    co_await ws_.async_close(reason, kAwait);  // takes at most kHandshakeTime; fails if the client closed first
    abort_connection();
  }

  websocket::stream<Stream> ws_;
  asio::steady_timer writer_wakeup_;  // the writer waits on it
  asio::steady_timer write_deadline_;
  asio::steady_timer read_delay_;  // the reader waits on it
  ServerContext& context_;
  Peer peer_;
  SessionThreads threads_;
  SessionState state_;
  std::optional<ScaleDemand::Use> use_;  // of its data set
  FairScheduler::Flow flow_;
  Clock::duration unscheduled_{0};                                                        // work of the reader since it had a worker
  std::optional<std::pair<FairScheduler::Lane, FairScheduler::Priority>> reader_worker_;  // if it has one
  RateLimit messages_, views_;
  std::uint64_t id_;
  Memory::Share memory_;        // of the state
  std::optional<Fault> fault_;  // why the session ends, once it does
  bool closed_ = false;         // the connection is gone: nothing can be sent
  Clock::time_point open_deadline_{};
  Clock::time_point stalled_since_{};  // when the client last had enough credit, or was sent a message
  ViewTiming timing_;
  std::uint64_t bytes_sent_ = 0;
  unsigned close_code_ = 0;
  std::string close_note_;
  Connections::Registration registration_;
};

}  // namespace

void start_websocket_session(Stream stream, const Request& request, ServerContext& context, Peer peer) {
  std::make_shared<WebSocketSession>(std::move(stream), context, std::move(peer))->start(request);
}

}  // namespace intervale
