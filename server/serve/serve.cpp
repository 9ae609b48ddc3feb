#include "server/serve/serve.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <functional>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "server/serve/catalogue_watcher.h"
#include "server/serve/server.h"

namespace intervale {
namespace {

constexpr std::chrono::seconds kPollTime{2};  // between looks at files that may have changed

// Both a build and an installation have the viewer there.
std::optional<std::filesystem::path> default_viewer() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return {};
  auto folder = (program.parent_path() / ".." / "share" / "intervale" / "viewer").lexically_normal();
  if (!std::filesystem::exists(folder / "index.html", error)) return {};
  return folder;
}

// Raises the limit on open files to what the connections may need, as far as the system permits.
void raise_file_limit(std::size_t connections) {
  constexpr rlim_t kOthers = 64;  // files, listeners, threads
  rlimit limit{};
  const rlim_t wanted = connections + kOthers;
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = std::min(wanted, limit.rlim_max);
  const bool raised = ::setrlimit(RLIMIT_NOFILE, &limit) == 0;
  if (raised && limit.rlim_cur >= wanted) return;
  spdlog::warn("the limit on open files is {}, too low for --max-connections {}: see ulimit -n", limit.rlim_cur, connections);
}

// The log level, and what SIGHUP makes of it.
class LevelSwitch {
 public:
  explicit LevelSwitch(const LogOptions& log) : log_(log), level_(log.level) {}
  void next() {
    if (const auto configured = log_.configured_level()) {
      if (!is_log_level(*configured))
        return spdlog::warn("the configuration has an invalid log level '{}'; the level stays at {}", *configured, level_);
      level_ = *configured;
    } else {
      level_ = level_ == "debug" ? (log_.level == "debug" ? "info" : log_.level) : "debug";
    }
    set_log_level("info");  // so that the next line is logged
    spdlog::info("SIGHUP: the log level is {}", level_);
    set_log_level(level_);
  }

 private:
  const LogOptions& log_;
  std::string level_;
};

// Calls act for every signal, while the io_context runs.
void on_each_signal(boost::asio::signal_set& signals, const std::function<void()>& act) {
  signals.async_wait([&signals, act](const boost::system::error_code& error, int) {
    if (error) return;
    act();
    on_each_signal(signals, act);
  });
}

// Calls act every kPollTime, and whenever the timer is cancelled, while the io_context runs.
void repeat(boost::asio::steady_timer& timer, const std::function<void()>& act) {
  timer.expires_after(kPollTime);
  timer.async_wait([&timer, act](const boost::system::error_code&) {
    act();
    repeat(timer, act);
  });
}

}  // namespace

Result<void> serve(const ServeOptions& requested, const LogOptions& log, const std::vector<std::filesystem::path>& inputs) {
  start_log(log);
  std::signal(SIGPIPE, SIG_IGN);  // writing to a closed connection is an error code, not a signal

  // Handled from the beginning, so that a signal during the start is not lost.
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
  on_each_signal(hang_up, [&] {
    level.next();
    timer.cancel();  // polls at once
  });

  raise_file_limit(requested.max_connections);
  ServeOptions options = requested;
  if (!options.viewer) options.viewer = default_viewer();
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
    (*server)->reload();
    if (auto changed = watcher.poll()) (*server)->offer(std::move(*changed));
  });
  signals.run();
  ending.clear();  // from now on a second signal ends the process at once
  spdlog::info("{}: draining", signal == SIGINT ? "SIGINT" : "SIGTERM");
  (*server)->stop();
  spdlog::info("stopped");
  return {};
}

}  // namespace intervale
