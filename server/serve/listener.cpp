#include "server/serve/listener.h"

#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <charconv>
#include <chrono>
#include <utility>

#include "protocol/transport/await.h"
#include "server/serve/http_session.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

}  // namespace

Result<tcp::endpoint> parse_endpoint(const std::string& text) {
  const auto wrong = [&] { return misuse("cannot read the address '" + text + "': address:port is wanted, such as 127.0.0.1:8080 or [::1]:8080"); };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return wrong();
  std::string host = text.substr(0, colon);
  const bool bracketed = host.size() >= 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  boost::system::error_code error;
  const auto address = asio::ip::make_address(host, error);
  if (error || address.is_v6() != bracketed) return wrong();
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, failure] = std::from_chars(text.data() + colon + 1, end, port);
  if (failure != std::errc() || stop != end) return wrong();
  return tcp::endpoint(address, port);
}

Listener::Listener(ConnectionThreads& threads, const tcp::endpoint& endpoint, ServerContext& context, PortRole role)
    : threads_(threads),
      acceptor_(asio::make_strand(threads.io()), endpoint),
      endpoint_(acceptor_.local_endpoint()),
      context_(context),
      role_(role) {}

Result<std::unique_ptr<Listener>> Listener::open(ConnectionThreads& threads, const std::string& address, ServerContext& context, PortRole role) {
  const auto endpoint = parse_endpoint(address);
  if (!endpoint) return tl::unexpected(endpoint.error());
  try {
    return std::unique_ptr<Listener>(new Listener(threads, *endpoint, context, role));
  } catch (const boost::system::system_error& error) {
    return fail("cannot listen on " + address + ": " + error.code().message());
  }
}

void Listener::start() { asio::co_spawn(acceptor_.get_executor(), accept_all(), asio::detached); }

// Through a trusted proxy, connections are counted, and paid for, by their client: from the upgrade on.
void Listener::admit(tcp::socket socket, ConnectionPayerPtr payer) {
  // The metrics port has no limit: monitoring matters most under load.
  if (role_ == PortRole::metrics) return start_http_session(std::move(socket), context_, role_, {}, std::move(payer));
  if (context_.connections.size() >= context_.options.max_connections) context_.metrics.count_refusal(Refusal::connections);
  if (!context_.connections.make_room(context_.options.max_connections)) return;  // and the socket closes
  boost::system::error_code error;
  const asio::ip::address peer = socket.remote_endpoint(error).address();
  if (error) return;  // the client has closed it already
  AddressCounts::Lease lease;
  if (!context_.options.proxies.contains(peer)) {
    if (const auto& most = context_.options.max_connections_per_address) {
      auto counted = context_.addresses.try_acquire(peer, *most);
      if (!counted) return context_.metrics.count_refusal(Refusal::address);
      lease = std::move(*counted);
    }
    payer->set(context_.accounts.of_address(peer));
  }
  start_http_session(std::move(socket), context_, role_, std::move(lease), std::move(payer));
}

asio::awaitable<void> Listener::accept_all() {
  for (;;) {
    auto payer = threads_.make_payer();
    const auto strand = asio::make_strand(ConnectionExecutor(payer));
    auto [error, accepted] = co_await acceptor_.async_accept(strand, kAwait);
    if (error) {
      // Most likely there is no file descriptor left: existing connections continue, and there may be one later.
      spdlog::warn("cannot accept a connection: {}", error.message());
      asio::steady_timer pause(acceptor_.get_executor(), std::chrono::milliseconds(100));
      co_await pause.async_wait(kAwait);
      continue;
    }
    admit(tcp::socket(std::move(accepted)), std::move(payer));
  }
}

}  // namespace intervale
