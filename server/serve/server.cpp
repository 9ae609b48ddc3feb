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
#include "server/serve/file_stamp.h"
#include "server/serve/listener.h"

namespace intervale {

namespace asio = boost::asio;

// Destroyed from the bottom up: threads are joined in stop(), then sessions go with the io_context that holds them, the context last.
struct Server::Running {
  explicit Running(const ServeOptions& options) : context(options) {}
  // Whether they had changed.
  Result<bool> load_tokens();
  Result<bool> load_certificate();
  ServerContext context;
  asio::io_context io;
  std::unique_ptr<Listener> listener, metrics_listener;
  std::vector<std::thread> threads;
  FileChanges tokens_changes, certificate_changes;
  std::string tokens_warning, certificate_warning;  // as last said, not to be said again
  bool stopped = false;
};

// The stamps are taken before reading: what is written meanwhile is then seen as a change. What failed is tried again, for it need not be the files'
// fault: a token that was taken out must not stay for want of a descriptor.
Result<bool> Server::Running::load_tokens() {
  const auto& path = context.options.tokens;
  if (!path || !tokens_changes.check({*path})) return false;
  auto tokens = Tokens::load(*path);
  if (!tokens) {
    tokens_changes.reset();
    return tl::unexpected(tokens.error());
  }
  context.tokens.store(std::make_shared<const Tokens>(std::move(*tokens)));
  return true;
}

Result<bool> Server::Running::load_certificate() {
  const auto& files = context.options.tls;
  if (!files || !certificate_changes.check({files->certificate, files->key})) return false;
  auto tls = TlsContext::server(files->certificate, files->key);
  if (!tls) {
    certificate_changes.reset();
    return tl::unexpected(tls.error());
  }
  context.tls.store(std::move(*tls));
  return true;
}

Server::Server(std::unique_ptr<Running> running) : running_(std::move(running)) {}

Server::~Server() { stop(); }

Result<std::unique_ptr<Server>> Server::start(const ServeOptions& wanted) {
  ServeOptions options = wanted;
  if (options.threads == 0) options.threads = std::max(1U, std::thread::hardware_concurrency());
  auto running = std::make_unique<Running>(options);
  if (options.viewer) {
    auto viewer = StaticFiles::load(*options.viewer);
    if (!viewer) return fail("no viewer: " + viewer.error().message);
    running->context.viewer = std::move(*viewer);
  }
  if (auto loaded = running->load_tokens(); !loaded) return tl::unexpected(loaded.error());
  if (auto loaded = running->load_certificate(); !loaded) return tl::unexpected(loaded.error());
  auto listener = Listener::open(running->io, options.listen, running->context, PortRole::all);
  if (!listener) return tl::unexpected(listener.error());
  running->listener = std::move(*listener);
  if (options.metrics_listen) {
    auto metrics_listener = Listener::open(running->io, *options.metrics_listen, running->context, PortRole::metrics);
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

Result<std::unique_ptr<Server>> Server::start(const ServeOptions& options, Catalogue catalogue) {
  auto server = start(options);
  if (server) (*server)->offer(std::move(catalogue));
  return server;
}

void Server::offer(Catalogue catalogue) { running_->context.catalogue.store(std::make_shared<const Catalogue>(std::move(catalogue))); }

void Server::refresh() {
  const auto tell = [](const Result<bool>& loaded, const char* what, std::string& complaint) {
    const std::string now = loaded ? std::string() : loaded.error().message;
    if (!now.empty() && now != complaint) spdlog::error("{}; what was read before holds", now);
    if (loaded && *loaded) spdlog::info("read the {} again", what);
    complaint = now;
  };
  tell(running_->load_tokens(), "tokens", running_->tokens_warning);
  tell(running_->load_certificate(), "certificate", running_->certificate_warning);
}

std::uint16_t Server::port() const { return running_->listener->endpoint().port(); }

std::uint16_t Server::metrics_port() const {
  return (running_->metrics_listener ? running_->metrics_listener : running_->listener)->endpoint().port();
}

std::string Server::url() const {
  std::ostringstream text;
  text << (running_->context.options.tls ? "https://" : "http://") << running_->listener->endpoint() << '/';
  return text.str();
}

void Server::stop() {
  if (std::exchange(running_->stopped, true)) return;
  running_->context.connections.begin_shutdown();
  if (!running_->context.connections.wait_until_empty(running_->context.options.drain_time)) {
    spdlog::warn("{} connections did not take their leave in time and are cut off", running_->context.connections.size());
  }
  running_->io.stop();
  for (std::thread& thread : running_->threads) thread.join();
  running_->context.scheduler.clear();
}

}  // namespace intervale
