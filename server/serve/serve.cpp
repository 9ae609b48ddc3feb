#include "server/serve/serve.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "server/serve/catalogue_watcher.h"
#include "server/serve/loading.h"
#include "server/serve/remote_data_sets.h"
#include "server/serve/server.h"

namespace intervale {
namespace {

constexpr std::chrono::seconds kPollTime{2};  // between looks at folders, and at tokens and certificates

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

// Where the data sets come from.
std::vector<Loading::Input> sources(const std::vector<std::filesystem::path>& inputs, RemoteInputs remote, const ServeOptions& options,
                                    Server& server) {
  std::vector<Loading::Input> all;
  if (!inputs.empty())
    all.push_back({std::make_unique<CatalogueWatcher>(inputs, server.memory(), options.tolerates_damage, server.scale_demand()), kPollTime});
  if (!remote.urls.empty()) {
    const auto time = std::min<std::chrono::milliseconds>(kPollTime, remote.poll_time);
    all.push_back({std::make_unique<RemoteDataSets>(std::move(remote), server.memory(), options.tolerates_damage, server.scale_demand()), time});
  }
  return all;
}

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

Result<void> serve(const ServeOptions& requested, const LogOptions& log, const std::vector<std::filesystem::path>& inputs, RemoteInputs remote) {
  start_log(log);
  std::signal(SIGPIPE, SIG_IGN);  // writing to a closed connection is an error code, not a signal

  // Caught from the beginning, so that a signal during the start is not lost.
  boost::asio::io_context signals;
  boost::asio::signal_set ending(signals, SIGINT, SIGTERM), hang_up(signals, SIGHUP);
  int signal = 0;
  ending.async_wait([&](const boost::system::error_code& error, int number) {
    if (!error) signal = number;
    signals.stop();
  });

  raise_file_limit(requested.max_connections);
  ServeOptions options = requested;
  if (!options.viewer) options.viewer = default_viewer();
  auto server = Server::start(options);
  if (!server) return tl::unexpected(server.error());
  Result<void> loaded;
  const std::string where = (options.viewer ? "; the viewer is at " : " at ") + (*server)->url();
  Loading loading(sources(inputs, std::move(remote), options, **server), **server, options.keep_time, where, [&](const Error& error) {
    boost::asio::post(signals, [&, error] {
      loaded = tl::unexpected(error);
      signals.stop();
    });
  });
  boost::asio::steady_timer timer(signals);
  LevelSwitch level(log);
  on_each_signal(hang_up, [&] {
    level.next();
    timer.cancel();  // reloads at once
    loading.poll_now();
  });
  repeat(timer, [&] { (*server)->reload(); });
  signals.run();
  ending.clear();  // from now on a second signal ends the process at once
  loading.request_stop();
  if (!loaded) return loaded;
  spdlog::info("{}: draining", signal == SIGINT ? "SIGINT" : "SIGTERM");
  (*server)->stop();
  spdlog::info("stopped");
  return {};
}

}  // namespace intervale
