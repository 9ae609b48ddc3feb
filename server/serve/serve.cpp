#include "server/serve/serve.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "common/parallel/all_cores.h"
#include "server/serve/catalogue_watcher.h"
#include "server/serve/server.h"
#include "server/serve/spare_cores.h"

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

// Loads the data sets, and follows the changes of their folders, on a thread of its own: that may take long, and signals
// are heard meanwhile.
class Loading {
 public:
  // where: the end of the line that tells what is served. failed: called on that thread if nothing can be served.
  Loading(const std::vector<std::filesystem::path>& inputs, RemoteInputs remote, const ServeOptions& options, Server& server, std::string where,
          std::function<void(const Error&)> failed)
      : watcher_(inputs, server.memory(), options.tolerates_damage, std::move(remote), server.scale_demand()),
        server_(server),
        keep_time_(options.keep_time),
        where_(std::move(where)),
        failed_(std::move(failed)) {
    if (auto* const demand = server_.scale_demand()) demand->set_wake([this] { wake(reads_on_); });
    thread_ = std::jthread([this](const std::stop_token& stop) { on_spare_cores([&] { run(stop); }); });
  }
  Loading(const Loading&) = delete;
  Loading& operator=(const Loading&) = delete;
  ~Loading() {
    if (auto* const demand = server_.scale_demand()) demand->set_wake([] {});
  }
  void poll_now() { wake(polls_); }
  void request_stop() { thread_.request_stop(); }

 private:
  using Clock = std::chrono::steady_clock;
  void run(const std::stop_token& stop) {
    try {
      SpareCores cores(stop, server_.scheduler(), SpareCores::Rests::while_sessions_wait, server_.memory().data_memory());
      const ParallelFor& parallel = cores.all();
      auto catalogue = watcher_.load(parallel);
      if (!catalogue) return failed_(catalogue.error());
      const std::size_t count = catalogue->volumes().size();
      server_.offer(std::move(*catalogue));
      spdlog::info("serving {} data set{}{}", count, count == 1 ? "" : "s", where_);
      while (!stop.stop_requested()) {
        for (auto more = watcher_.complete(parallel); !more || *more; more = watcher_.complete(parallel)) {
          if (!more) return failed_(more.error());
          server_.offer(std::move(**more));
          // Folders do not wait for all of it.
          if (server_.scale_demand() != nullptr && Clock::now() >= next_poll_) break;
        }
        if (!wait_until_poll(stop)) continue;
        if (auto changed = watcher_.poll(parallel)) server_.offer(std::move(*changed));
        if (auto fewer = watcher_.drop_unused(keep_time_)) server_.offer(std::move(*fewer));
      }
    } catch (const Stopped&) {
    } catch (const std::exception& exception) {
      failed_({exception.what()});
    }
  }
  void wake(bool& why) {
    const std::lock_guard lock(mutex_);
    why = true;
    wake_.notify_one();
  }
  // Whether it is time to look at the folders; or something is to be read on before, or this is to stop.
  bool wait_until_poll(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    wake_.wait_until(lock, stop, next_poll_, [this] { return polls_ || reads_on_; });
    reads_on_ = false;
    if (stop.stop_requested() || (!polls_ && Clock::now() < next_poll_)) return false;
    polls_ = false;
    next_poll_ = Clock::now() + kPollTime;
    return true;
  }

  CatalogueWatcher watcher_;
  Server& server_;
  std::chrono::milliseconds keep_time_;
  std::string where_;
  std::function<void(const Error&)> failed_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  bool polls_ = false, reads_on_ = false;  // what it was woken for
  Clock::time_point next_poll_ = Clock::now() + kPollTime;
  std::jthread thread_;  // the last member: it uses the others
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
  Loading loading(inputs, std::move(remote), options, **server, (options.viewer ? "; the viewer is at " : " at ") + (*server)->url(),
                  [&](const Error& error) {
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
