#include "server/serve/serve.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "server/serve/catalogue_watcher.h"
#include "server/serve/server.h"

namespace intervale {
namespace {

constexpr std::chrono::seconds kLook{2};  // at files that may have changed

// Where a build and an installation alike put the viewer.
std::optional<std::filesystem::path> viewer_beside_the_program() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return {};
  auto folder = (program.parent_path() / ".." / "share" / "intervale" / "viewer").lexically_normal();
  if (!std::filesystem::exists(folder / "index.html", error)) return {};
  return folder;
}

// Descriptors: as many as connections may take, if that is allowed.
void make_room_for(std::size_t connections) {
  constexpr rlim_t kOthers = 64;  // files, listeners, threads
  rlimit limit{};
  const rlim_t wanted = connections + kOthers;
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = std::min(wanted, limit.rlim_max);
  const bool raised = ::setrlimit(RLIMIT_NOFILE, &limit) == 0;
  if (raised && limit.rlim_cur >= wanted) return;
  spdlog::warn("the process may open {} files, and --max-connections is {}: see ulimit -n", limit.rlim_cur, connections);
}

class LevelSwitch {
 public:
  explicit LevelSwitch(const LogOptions& log) : log_(log), level_(log.level) {}
  void next() {
    if (const auto configured = log_.configured_level()) {
      if (!is_log_level(*configured)) return spdlog::warn("the log level '{}' of the configuration is none; it stays at {}", *configured, level_);
      level_ = *configured;
    } else {
      level_ = level_ == "debug" ? (log_.level == "debug" ? "info" : log_.level) : "debug";
    }
    set_log_level("info");  // for the next line
    spdlog::info("SIGHUP: the log level is {}", level_);
    set_log_level(level_);
  }

 private:
  const LogOptions& log_;
  std::string level_;
};

// As long as the io_context runs.
void await_each(boost::asio::signal_set& signals, const std::function<void()>& act) {
  signals.async_wait([&signals, act](const boost::system::error_code& error, int) {
    if (error) return;
    act();
    await_each(signals, act);
  });
}

// Now and then, and whenever the timer is cancelled, as long as the io_context runs.
void repeat(boost::asio::steady_timer& timer, const std::function<void()>& act) {
  timer.expires_after(kLook);
  timer.async_wait([&timer, act](const boost::system::error_code&) {
    act();
    repeat(timer, act);
  });
}

}  // namespace

Result<void> serve(const ServeOptions& wanted, const LogOptions& log, const std::vector<std::filesystem::path>& inputs) {
  start_log(log);
  std::signal(SIGPIPE, SIG_IGN);  // a client that left is an error code, not an end

  // Taken over before anything else, so that a signal during the start is not lost.
  boost::asio::io_context signals;
  boost::asio::signal_set ending(signals, SIGINT, SIGTERM);
  int signal = 0;
  ending.async_wait([&](const boost::system::error_code& error, int number) {
    if (!error) signal = number;
    signals.stop();
  });
  boost::asio::signal_set hang_up(signals, SIGHUP);
  boost::asio::steady_timer timer(signals);
  LevelSwitch level(log);
  await_each(hang_up, [&] {
    level.next();
    timer.cancel();  // and looks at once
  });

  make_room_for(wanted.max_connections);
  ServeOptions options = wanted;
  if (!options.viewer) options.viewer = viewer_beside_the_program();
  auto server = Server::start(options);
  if (!server) return tl::unexpected(server.error());
  CatalogueWatcher watcher(inputs, options.max_memory);
  auto catalogue = watcher.load([&] {
    signals.poll();
    return signal == 0;
  });
  if (!catalogue) return tl::unexpected(catalogue.error());
  const std::size_t count = catalogue->volumes().size();
  (*server)->offer(std::move(*catalogue));
  spdlog::info("serving {} data set{}{}{}", count, count == 1 ? "" : "s", options.viewer ? "; the viewer is at " : " at ", (*server)->url());

  repeat(timer, [&] {
    (*server)->refresh();
    if (auto changed = watcher.poll()) (*server)->offer(std::move(*changed));
  });
  signals.run();
  ending.clear();  // a second signal ends it at once
  spdlog::info("{}: draining", signal == SIGINT ? "SIGINT" : "SIGTERM");
  (*server)->stop();
  spdlog::info("stopped");
  return {};
}

}  // namespace intervale
