#include "server/serve/server.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "server/serve/context.h"
#include "server/serve/file_stamp.h"
#include "server/serve/listener.h"

namespace intervale {

namespace asio = boost::asio;

// Destroyed from the bottom up: threads are joined in stop(), then sessions go with the io_context that holds them, the context last.
struct Server::Running {
  explicit Running(const ServeOptions& options) : context(options) {}
  Result<void> load_tokens();
  ServerContext context;
  asio::io_context io;
  std::unique_ptr<Listener> listener, metrics_listener;
  std::vector<std::thread> threads;
  std::optional<FileStamp> tokens_stamp;
  bool stopped = false;
};

Result<void> Server::Running::load_tokens() {
  const auto& path = context.options.tokens;
  if (!path) return {};
  // The stamp first: what is written while we read is then seen as a change.
  const auto stamp = stamp_of(*path);
  if (stamp && stamp == tokens_stamp) return {};
  const bool again = std::exchange(tokens_stamp, stamp).has_value();
  auto tokens = Tokens::load(*path);
  if (!tokens) return tl::unexpected(tokens.error());
  context.tokens.set(std::make_shared<const Tokens>(std::move(*tokens)));
  if (again) spdlog::info("read the tokens in {} again", path->string());
  return {};
}

Server::Server(std::unique_ptr<Running> running) : running_(std::move(running)) {}

Server::~Server() { stop(); }

Result<std::unique_ptr<Server>> Server::start(const ServeOptions& wanted, Catalogue catalogue) {
  ServeOptions options = wanted;
  if (options.threads == 0) options.threads = std::max(1U, std::thread::hardware_concurrency());
  auto running = std::make_unique<Running>(options);
  running->context.catalogue = std::move(catalogue);
  if (options.viewer) {
    auto viewer = StaticFiles::load(*options.viewer);
    if (!viewer) return fail("no viewer: " + viewer.error().message);
    running->context.viewer = std::move(*viewer);
  }
  if (auto loaded = running->load_tokens(); !loaded) return tl::unexpected(loaded.error());
  auto listener = Listener::open(running->io, options.listen, running->context, Door::all);
  if (!listener) return tl::unexpected(listener.error());
  running->listener = std::move(*listener);
  if (options.metrics_listen) {
    auto metrics_listener = Listener::open(running->io, *options.metrics_listen, running->context, Door::metrics);
    if (!metrics_listener) return tl::unexpected(metrics_listener.error());
    running->metrics_listener = std::move(*metrics_listener);
    running->metrics_listener->start();
  }
  running->listener->start();
  for (unsigned i = 0; i < options.threads; ++i) {
    running->threads.emplace_back([&io = running->io, work = asio::make_work_guard(running->io)] { io.run(); });
  }
  return std::unique_ptr<Server>(new Server(std::move(running)));
}

void Server::refresh() {
  const auto before = running_->tokens_stamp;
  if (auto loaded = running_->load_tokens(); !loaded && running_->tokens_stamp != before) {
    spdlog::error("{}; those from before hold", loaded.error().message);
  }
}

std::uint16_t Server::port() const { return running_->listener->endpoint().port(); }

std::uint16_t Server::metrics_port() const {
  return (running_->metrics_listener ? running_->metrics_listener : running_->listener)->endpoint().port();
}

std::string Server::url() const {
  std::ostringstream text;
  text << "http://" << running_->listener->endpoint() << '/';
  return text.str();
}

void Server::stop() {
  if (std::exchange(running_->stopped, true)) return;
  running_->listener->close();
  if (running_->metrics_listener) running_->metrics_listener->close();
  running_->context.connections.go_away();
  if (!running_->context.connections.wait_until_empty(running_->context.options.drain_time)) {
    spdlog::warn("{} connections did not take their leave in time and are cut off", running_->context.connections.size());
  }
  running_->io.stop();
  for (std::thread& thread : running_->threads) thread.join();
  running_->context.turnstile.clear();
}

}  // namespace intervale
