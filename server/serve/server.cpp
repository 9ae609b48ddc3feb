#include "server/serve/server.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "server/serve/context.h"
#include "server/serve/listener.h"

namespace intervale {

namespace asio = boost::asio;

// Destroyed from the bottom up: threads are joined in stop(), then sessions go with the io_context that holds them, the context last.
struct Server::Running {
  explicit Running(unsigned count) : context(count) {}
  ServerContext context;
  asio::io_context io;
  std::unique_ptr<Listener> listener, metrics_listener;
  std::vector<std::thread> threads;
  bool stopped = false;
};

Server::Server(std::unique_ptr<Running> running) : running_(std::move(running)) {}

Server::~Server() { stop(); }

Result<std::unique_ptr<Server>> Server::start(const ServeOptions& options, Catalogue catalogue) {
  const unsigned count = options.threads != 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  auto running = std::make_unique<Running>(count);
  running->context.options = options;
  running->context.catalogue = std::move(catalogue);
  if (options.viewer) {
    auto viewer = StaticFiles::load(*options.viewer);
    if (!viewer) return fail("no viewer: " + viewer.error().message);
    running->context.viewer = std::move(*viewer);
  }
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
  for (unsigned i = 0; i < count; ++i) {
    running->threads.emplace_back([&io = running->io, work = asio::make_work_guard(running->io)] { io.run(); });
  }
  return std::unique_ptr<Server>(new Server(std::move(running)));
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
