#include "server/serve/http_session.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <cctype>
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "protocol/transport/await.h"
#include "server/serve/request_target.h"
#include "server/serve/websocket_session.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::chrono::seconds kKeepAliveTime{30};  // between requests
constexpr std::chrono::seconds kWriteTime{30};
constexpr std::chrono::milliseconds kShutdownTime{1000};
constexpr std::uint32_t kMaxHeader = 4096;
// Measured: of a connection, with the session that it becomes but for its messages and what was sent; of its TLS.
constexpr std::uint64_t kConnectionMemory = 21 << 9, kTlsMemory = 55 << 10;

using Request = http::request<http::empty_body>;
using Response = http::response<http::span_body<const char>>;

// The values of a field that is a list, which may stand in several lines.
template <class Name>
std::string list_of(const Request& request, Name name) {
  std::string list;
  const auto [begin, end] = request.equal_range(name);
  for (auto field = begin; field != end; ++field) list.append(list.empty() ? "" : ",").append(field->value());
  return list;
}

bool offers_subprotocol(const Request& request) {
  const std::string list = list_of(request, http::field::sec_websocket_protocol);
  const http::token_list names{list};
  return std::any_of(names.begin(), names.end(), [](const auto& name) { return name == protocol::kSubprotocol; });
}

// Whether there is one key, and it stands for 16 bytes in base64 (RFC 6455, section 4.2.1).
bool has_websocket_key(const Request& request) {
  constexpr std::size_t kDigits = 22;
  const std::string key = list_of(request, http::field::sec_websocket_key);
  const auto is_digit = [](unsigned char c) { return (c < 0x80 && std::isalnum(c) != 0) || c == '+' || c == '/'; };
  return key.size() == kDigits + 2 && key.ends_with("==") && std::all_of(key.begin(), key.begin() + kDigits, is_digit);
}

std::optional<std::string> token_in(const Request& request) {
  return token_of(request[http::field::authorization], list_of(request, http::field::sec_websocket_protocol));
}

// Whether the end of the body is known, if it has one (RFC 9112, section 6.3).
bool has_known_end(const Request& request, const http::request_parser<http::empty_body>& parser) {
  return request.count(http::field::transfer_encoding) == 0 || parser.chunked();
}

// Gives the request the target and the host that it is for. False: it is malformed.
bool resolve_target(Request& request) {
  std::vector<std::string_view> hosts;
  const auto fields = request.equal_range(http::field::host);
  for (auto field = fields.first; field != fields.second; ++field) hosts.emplace_back(field->value());
  const auto asked = request_target(request.target(), hosts, request.version());
  if (!asked) return false;
  request.target(asked->target);
  request.set(http::field::host, asked->host);
  return true;
}

// Whether a line of a header continues the one before it.
bool has_folded_line(std::string_view header) {
  return header.find("\r\n ") != std::string_view::npos || header.find("\r\n\t") != std::string_view::npos;
}

// Refers to the content's body, which must live until the response is sent.
Response make_response(const Request& request, const HttpResponse& content, bool keep_alive) {
  Response response(http::status(content.status), request.version());
  response.set(http::field::server, std::string(protocol::kServerName) + "/" INTERVALE_VERSION);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Content-Security-Policy", content.content_security_policy);
  response.set(http::field::cache_control, content.cache_control);
  for (const auto& [name, value] : content.headers) response.set(name, value);
  if (content.status == 405) response.set(http::field::allow, "GET, HEAD");
  response.keep_alive(keep_alive);
  if (content.status == 426) {
    response.set(http::field::upgrade, "websocket");
    response.insert(http::field::connection, "Upgrade");
  }
  if (!content.body) return response;  // a 304 has no length either
  response.set(http::field::content_type, content.content_type);
  response.content_length(content.body->size());
  if (request.method() != http::verb::head) response.body() = {content.body->data(), content.body->size()};
  return response;
}

class HttpSession : public Connection, public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(asio::ip::tcp::socket socket, ServerContext& context, PortRole role, AddressCounts::Lease address_lease, ConnectionPayerPtr payer)
      : stream_(std::move(socket)),
        deadline_(stream_.get_executor()),
        strand_(stream_.get_executor()),
        context_(context),
        role_(role),
        address_lease_(std::move(address_lease)),
        payer_(std::move(payer)),
        memory_(context.memory, Memory::Holder::sessions, kConnectionMemory) {}
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;
  ~HttpSession() override { context_.metrics.connections.Decrement(); }

  void start() {
    context_.metrics.connections.Increment();
    registration_ = context_.connections.add(shared_from_this());
    asio::co_spawn(strand_, run(shared_from_this()), [](const std::exception_ptr& failure) { report(failure); });
  }

  void abort(const char* /*why*/) override {
    asio::post(strand_, [self = shared_from_this()] { self->stream_.close(); });
  }

  void begin_shutdown() override {
    asio::post(strand_, [self = shared_from_this()] {
      self->draining_ = true;
      // The first request may be on its way, and gets a response, such as "draining". So does a request that was read.
      if (self->phase_ == Phase::first_request) self->expire_after(kShutdownTime);
      if (self->phase_ == Phase::next_request) self->stream_.socket().cancel();
    });
  }

 private:
  // What the connection does, or waits for.
  enum class Phase { handshake, first_request, response, next_request };

  static void report(const std::exception_ptr& failure) {
    if (!failure) return;
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& exception) {
      spdlog::error("http: {}", exception.what());
    }
  }

  // The connection closes when this coroutine ends, unless an upgrade has moved the socket away. `self` keeps the
  // object alive.
  asio::awaitable<void> run([[maybe_unused]] std::shared_ptr<HttpSession> self) {
    if (!co_await begin_tls()) co_return;
    do {
      http::request_parser<http::empty_body> parser;
      parser.header_limit(kMaxHeader);
      parser.body_limit(boost::none);  // bodies are not read
      const bool first = phase_ == Phase::handshake;
      const std::chrono::milliseconds header_time = first ? context_.options.handshake_time : kKeepAliveTime;
      expire_after(draining_ ? kShutdownTime : header_time);
      phase_ = first ? Phase::first_request : Phase::next_request;
      if (!first) context_.connections.set_waiting(registration_, true);
      beast::error_code error = co_await read_header(parser);
      phase_ = Phase::response;
      context_.connections.set_waiting(registration_, false);
      Request request = parser.get();
      if (!error && !resolve_target(request)) error = http::error::bad_value;
      if (!error && !has_known_end(request, parser)) error = http::error::bad_transfer_encoding;
      if (error) {
        co_await reject_malformed(error);
        break;
      }
      // Bodies are not read, so the next request's start is unknown after one: the connection closes after this
      // response.
      const bool has_body = parser.content_length().value_or(0) > 0 || request.count(http::field::transfer_encoding) > 0;
      if (beast::websocket::is_upgrade(request) && role_ == PortRole::all && request.target() == protocol::kPath) {
        if (const auto refusal = check_upgrade(request, has_body || buffer_.size() > 0)) {
          co_await send(request, *refusal, false);
          break;
        }
        deadline_.cancel();  // the WebSocket session has its own deadlines
        Peer peer{scope_for(request), std::move(address_lease_), std::move(memory_), account_for(request)};  // while the stream is here
        payer_->set(peer.account);
        start_websocket_session(std::move(stream_), request, context_, std::move(peer));
        co_return;
      }
      const bool keep_alive = request.keep_alive() && !has_body && !draining_;
      const HttpResponse content = route(request);
      if (content.status == 401) context_.metrics.count_refusal(Refusal::token);
      if (!co_await send(request, content, keep_alive) || !keep_alive) break;
    } while (!draining_);
    expire_after(kShutdownTime);
    beast::error_code ignored;
    if (stream_.tls() != nullptr) co_await stream_.async_shutdown(kAwait);
    deadline_.cancel();
    if (stream_.socket().is_open()) stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
  }

  // As http::async_read_header, which however accepts folded lines: what stands between may read them differently (RFC
  // 9112, section 5.2). The parser's own limit does not count lines that it has taken before.
  asio::awaitable<beast::error_code> read_header(http::request_parser<http::empty_body>& parser) {
    for (std::size_t taken = 0;;) {
      beast::error_code error = http::error::need_more;
      const auto bytes = buffer_.data();
      const std::size_t size = bytes.size() > 0 ? parser.put(bytes, error) : 0;
      taken += size;
      const std::size_t known = error == http::error::need_more ? taken + bytes.size() - size : taken;
      if (known > kMaxHeader) error = http::error::header_limit;
      if (!error && has_folded_line({static_cast<const char*>(bytes.data()), size})) error = http::error::bad_obs_fold;
      buffer_.consume(size);
      if (error != http::error::need_more) co_return error;
      const auto [failed, received] = co_await stream_.async_read_some(buffer_.prepare(kMaxHeader), kAwait);
      if (failed) co_return failed;
      buffer_.commit(received);
    }
  }

  // False if the handshake failed. The metrics port speaks plain HTTP.
  asio::awaitable<bool> begin_tls() {
    auto tls = context_.tls.load();
    if (!tls || role_ != PortRole::all) co_return true;
    stream_.use_tls(std::move(tls));
    memory_.resize(kConnectionMemory + kTlsMemory);
    expire_after(context_.options.handshake_time);
    const auto [error] = co_await stream_.async_handshake(kAwait);
    if (error) spdlog::debug("TLS handshake failed: {}", error.message());
    co_return !error;
  }

  // Closes the connection after that time, unless the deadline is set again or cancelled before.
  void expire_after(std::chrono::milliseconds time) {
    deadline_.expires_after(time);
    deadline_.async_wait([weak = weak_from_this()](beast::error_code error) {
      if (const auto self = weak.lock(); self && !error) self->stream_.close();
    });
  }

  HttpResponse route(const Request& request) const {
    if (role_ == PortRole::all && request.target() == protocol::kPath)
      return text_response(426, "upgrade required: this path accepts WebSocket connections only");
    const auto scope = scope_for(request);
    const auto catalogue = context_.catalogue.load();
    const auto tls = context_.tls.load();
    static const Catalogue kEmpty;
    const auto& allowed = context_.options.allowed_origins;
    const std::string_view origin = request[http::field::origin], host = request[http::field::host];
    const HttpRequest parsed{.method = request.method_string(),
                             .target = request.target(),
                             .host = host,
                             .accept_encoding = request[http::field::accept_encoding],
                             .if_none_match = request[http::field::if_none_match],
                             .allowed_origin = !allowed.empty() && is_allowed_origin(origin, host, allowed) ? origin : std::string_view(),
                             .scope = scope.get()};
    return respond(parsed, {.catalogue = catalogue ? *catalogue : kEmpty,
                            .metrics = context_.metrics,
                            .memory = context_.memory,
                            .viewer = context_.viewer,
                            .queued_bytes = context_.write_budget.bytes(),
                            .role = role_,
                            .has_metrics_port = context_.options.metrics_listen.has_value(),
                            .certificate_expires = tls ? std::optional(tls->expires()) : std::nullopt,
                            .server_status = server_status(),
                            .connect_origins = context_.options.connect_origins});
  }

  // The response that refuses the upgrade; nullopt if a session may be opened. has_more: a body, or bytes that did not
  // wait for the answer, which would be taken for frames.
  std::optional<HttpResponse> check_upgrade(const Request& request, bool has_more) {
    const ServerStatus status = server_status();
    if (status == ServerStatus::loading || status == ServerStatus::draining) return text_response(503, text_of(status));
    if (has_more || !has_websocket_key(request)) return text_response(400, "an upgrade has one key of 16 bytes, and no body");
    if (!offers_subprotocol(request)) return text_response(400, "the request does not offer the subprotocol intervale.v1");
    const std::string_view origin = request[http::field::origin], host = request[http::field::host];
    if (!is_allowed_origin(origin, host, context_.options.allowed_origins)) {
      return refused(Refusal::origin, text_response(403, "pages of this origin may not open sessions"));
    }
    // A page cannot read the response to its upgrade: its session is opened, and then closed with a code.
    if (origin.empty() && scope_for(request) == nullptr) return refused(Refusal::token, unauthorized());
    auto limit = limit_reached();
    if (!limit && !count_client(request)) limit = Refusal::address;
    return limit ? std::optional(refused(*limit, retry_later("the server has no capacity for another session", "5"))) : std::nullopt;
  }

  // Why no new session may be opened.
  [[nodiscard]] std::optional<Refusal> limit_reached() const {
    const auto& max_sessions = context_.options.max_sessions;
    if (max_sessions && context_.metrics.sessions.Value() >= double(*max_sessions)) return Refusal::sessions;
    if (context_.memory.is_full()) return Refusal::memory;
    return {};
  }

  [[nodiscard]] ServerStatus server_status() const {
    if (context_.connections.draining()) return ServerStatus::draining;
    if (!context_.catalogue.load()) return ServerStatus::loading;
    return limit_reached() ? ServerStatus::full : ServerStatus::ready;
  }

  [[nodiscard]] HttpResponse refused(Refusal reason, HttpResponse response) const {
    context_.metrics.count_refusal(reason);
    return response;
  }

  // What the request's token grants; nullptr: nothing.
  [[nodiscard]] std::shared_ptr<const Scope> scope_for(const Request& request) const {
    const auto tokens = context_.tokens.load();
    if (!tokens) return Scope::everything();
    const auto token = token_in(request);
    return token ? tokens->find(*token) : nullptr;
  }

  // Of a connection through a trusted proxy, which the listener does not count. False if there are too many.
  bool count_client(const Request& request) {
    const auto& most = context_.options.max_connections_per_address;
    if (!most || address_lease_) return true;
    auto lease = context_.addresses.try_acquire(client_address(request), *most);
    if (lease) address_lease_ = std::move(*lease);
    return lease.has_value();
  }

  // That pays for the session's work.
  [[nodiscard]] std::shared_ptr<Accounts::Account> account_for(const Request& request) {
    if (context_.tokens.load() && scope_for(request)) {
      return context_.accounts.of_token(*token_in(request));
    }
    return context_.accounts.of_address(client_address(request));
  }

  // Of the client, behind trusted proxies, too.
  [[nodiscard]] asio::ip::address client_address(const Request& request) {
    beast::error_code ignored;
    return context_.options.proxies.client(stream_.socket().remote_endpoint(ignored).address(), list_of(request, "X-Forwarded-For"));
  }

  // Answers bytes that are no request. Other errors, such as a closed connection, have no answer.
  asio::awaitable<void> reject_malformed(beast::error_code error) {
    if (error.category() != http::make_error_code(http::error::bad_target).category()) co_return;
    const bool too_long = error == http::error::header_limit || error == http::error::buffer_overflow;
    const HttpResponse content = too_long ? text_response(431, "request header too large") : text_response(400, "malformed request");
    const Request request(http::verb::get, "/", 11);
    co_await send(request, content, false);
  }

  // Pass no temporaries: g++ 12 destroys some temporaries of a co_await expression twice.
  asio::awaitable<bool> send(const Request& request, const HttpResponse& content, bool keep_alive) {
    Response response = make_response(request, content, keep_alive);
    expire_after(kWriteTime);
    const auto [error, size] = co_await http::async_write(stream_, response, kAwait);
    co_return !error;
  }

  Stream stream_;
  asio::steady_timer deadline_;
  asio::any_io_executor strand_;  // a copy: other threads use it, and an upgrade moves the stream away
  ServerContext& context_;
  PortRole role_;
  AddressCounts::Lease address_lease_;
  ConnectionPayerPtr payer_;
  Memory::Share memory_;
  beast::flat_buffer buffer_{2 * kMaxHeader};
  Phase phase_ = Phase::handshake;
  bool draining_ = false;
  Connections::Registration registration_;
};

}  // namespace

void start_http_session(asio::ip::tcp::socket socket, ServerContext& context, PortRole role, AddressCounts::Lease address_lease,
                        ConnectionPayerPtr payer) {
  std::make_shared<HttpSession>(std::move(socket), context, role, std::move(address_lease), std::move(payer))->start();
}

}  // namespace intervale
