#include "server/serve/server.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "server/serve/connection_executor.h"
#include "server/serve/context.h"
#include "server/serve/file_stamp.h"
#include "server/serve/listener.h"

namespace intervale {

namespace {

// Files that are read together at the start, and again when one of them has changed.
struct ReloadedFiles {
  const char* what;  // for the log
  std::vector<std::filesystem::path> paths;
  std::function<Result<void>()> read;
  std::vector<std::optional<FileStamp>> stamps = {};  // when they were read; empty: never
  std::string last_warning = {};                      // logged, not to be repeated

  // True if the files had changed and were read. The stamps are taken before reading, so that a write during the read
  // counts as a change. After a failure the next call tries again even if the files stay as they are: a revoked token
  // must not remain valid because there was no file descriptor.
  Result<bool> load() {
    std::vector<std::optional<FileStamp>> now;
    for (const std::filesystem::path& path : paths) now.push_back(stamp_of(path));
    if (now == std::exchange(stamps, now)) return false;
    const auto done = read();
    if (!done) stamps.clear();
    return done.map([] { return true; });
  }

  void reload() {
    const auto loaded = load();
    const std::string warning = loaded ? std::string() : loaded.error().message;
    if (!warning.empty() && warning != last_warning) spdlog::error("{}; the data read before stays in use", warning);
    if (loaded && *loaded) spdlog::info("reloaded the {}", what);
    last_warning = warning;
  }
};

}  // namespace

// Members are destroyed from last to first: stop() has joined the threads, whose contexts destroy the sessions, which
// use the server's context.
struct Server::Running {
  explicit Running(const ServeOptions& options);
  ServerContext context;
  ConnectionThreads threads{context.scheduler};
  std::unique_ptr<Listener> listener, metrics_listener;
  std::vector<ReloadedFiles> files;
  std::jthread trimming = start_trimming(context.memory);
  bool stopped = false;
};

Server::Running::Running(const ServeOptions& options) : context(options) {
  const auto load_tokens = [this] {
    return Tokens::load(*context.options.tokens).map([this](const Tokens& tokens) { context.tokens.store(std::make_shared<const Tokens>(tokens)); });
  };
  const auto load_certificate = [this] {
    const TlsFiles& tls = *context.options.tls;
    return TlsContext::server(tls.certificate, tls.key).map([this](const auto& loaded) { context.tls.store(loaded); });
  };
  if (options.tokens) files.push_back({"tokens", {*options.tokens}, load_tokens});
  if (options.tls) files.push_back({"certificate", {options.tls->certificate, options.tls->key}, load_certificate});
}

Server::Server(std::unique_ptr<Running> running) : running_(std::move(running)) {}

Server::~Server() { stop(); }

Result<std::unique_ptr<Server>> Server::start(const ServeOptions& requested) {
  ServeOptions options = requested;
  if (options.threads == 0) options.threads = std::max(1U, std::thread::hardware_concurrency());
  auto running = std::make_unique<Running>(options);
  if (options.viewer) {
    auto viewer = StaticFiles::load(*options.viewer);
    if (!viewer) return fail("cannot load the viewer: " + viewer.error().message);
    running->context.viewer = std::move(*viewer);
  }
  for (ReloadedFiles& files : running->files) {
    if (auto loaded = files.load(); !loaded) return tl::unexpected(loaded.error());
  }
  auto listener = Listener::open(running->threads, options.listen, running->context, PortRole::all);
  if (!listener) return tl::unexpected(listener.error());
  running->listener = std::move(*listener);
  if (options.metrics_listen) {
    auto metrics_listener = Listener::open(running->threads, *options.metrics_listen, running->context, PortRole::metrics);
    if (!metrics_listener) return tl::unexpected(metrics_listener.error());
    running->metrics_listener = std::move(*metrics_listener);
    running->metrics_listener->start();
  }
  running->listener->start();
  running->threads.start(options.threads);
  return std::unique_ptr<Server>(new Server(std::move(running)));
}

void Server::offer(Catalogue catalogue) {
  running_->context.catalogue.store(std::make_shared<const Catalogue>(std::move(catalogue)));
  running_->context.connections.catalogue_changed();
}

void Server::reload() {
  for (ReloadedFiles& files : running_->files) files.reload();
}

Memory& Server::memory() { return running_->context.memory; }
ScaleDemand* Server::scale_demand() { return running_->context.options.on_demand ? &running_->context.scale_demand : nullptr; }
const FairScheduler& Server::scheduler() const { return running_->context.scheduler; }

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
    spdlog::warn("closing {} connections that did not close within the drain time", running_->context.connections.size());
  }
  running_->threads.stop();
  running_->context.scheduler.clear();
  running_->context.ranges.stop();
  running_->context.background.stop();
}

}  // namespace intervale
