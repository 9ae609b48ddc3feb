#include "client/load/load_run.h"

#include <fmt/core.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstddef>
#include <future>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "client/load/range_path.h"
#include "client/load/run_clients.h"
#include "client/load/verify_meshes.h"
#include "client/net/blocking_connection.h"
#include "client/net/connection.h"
#include "client/net/fetch.h"
#include "common/program/program.h"
#include "common/program/progress.h"
#include "common/util/printable.h"

namespace intervale {
namespace {

constexpr rlim_t kOtherFiles = 64;                   // besides the clients' sockets
constexpr std::chrono::milliseconds kStartTime{20};  // for threads and clients to start before the first client is due

// Raises the limit of open files as far as allowed: each client has a socket.
Result<void> allow_files(unsigned clients) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return {};  // then opening the sockets fails with a reason
  const rlim_t wanted = clients + kOtherFiles;
  if (limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= wanted) return {};
  limit.rlim_cur = limit.rlim_max;
  (void)::setrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_max != RLIM_INFINITY && limit.rlim_max < wanted) {
    return fail(fmt::format("{} clients need {} open files, and this process may have {}: raise the limit (ulimit -n) or take fewer clients", clients,
                            wanted, limit.rlim_max));
  }
  return {};
}

// The description of the data set: cameras move around its box. No view is sent, and no credit.
Result<Description> describe(const ServerUrl& url) {
  auto connection = StreamConnection::open(url);
  if (!connection) return tl::unexpected(connection.error());
  ClientSession session({.dataset = url.name,
                         .client = "intervale-load " INTERVALE_VERSION,
                         .server = "the server at " + url.authority(),
                         .max_bytes = 0,
                         .has_mesh = false});
  session.connected(ClientSession::Clock::now());
  if (auto sent = connection->send(session); !sent) return tl::unexpected(sent.error());
  if (const auto opened = connection->receive(session); !opened) return tl::unexpected(opened.error());
  connection->close();
  return *session.description();
}

double cpu_seconds(int whose) {
  rusage usage{};
  ::getrusage(whose, &usage);
  const auto seconds = [](const timeval& time) { return double(time.tv_sec) + 1e-6 * double(time.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// What the clients of one thread, or of several, measured.
struct Share {
  LoadStats stats;
  double cpu_seconds = 0;  // of the busiest thread
};

// Runs the clients on threads. Shows the progress on a terminal once a second, until all threads have ended.
Share run_threads(const LoadPlan& plan, unsigned threads, std::vector<std::optional<LoadedMesh>>& meshes) {
  LoadProgress progress;
  std::vector<std::future<Share>> running;
  for (unsigned first = 0; first < threads; ++first) {
    running.push_back(std::async(std::launch::async, [&, first] {
      LoadStats stats = run_clients(plan, first, threads, meshes, progress);
      return Share{std::move(stats), cpu_seconds(RUSAGE_THREAD)};
    }));
  }
  Progress line("loading " + printable(plan.url.name));
  std::uint64_t updates = 0, bytes = 0;
  Share all;
  for (std::future<Share>& thread : running) {
    while (thread.wait_for(std::chrono::seconds(1)) == std::future_status::timeout) {
      const std::uint64_t updates_now = progress.updates, bytes_now = progress.bytes;
      line.text(fmt::format("{} of {} clients, {} updates/s, {}/s", progress.connected.load(), plan.clients, updates_now - updates,
                            human_bytes(bytes_now - bytes)));
      updates = updates_now;
      bytes = bytes_now;
    }
    Share share = thread.get();
    all.stats.add(std::move(share.stats));
    all.cpu_seconds = std::max(all.cpu_seconds, share.cpu_seconds);
  }
  return all;
}

// What the clients show, at first if they drag it.
Result<RangeRequest> shown_by(const ServerUrl& url, const LoadOptions& options, const Description& description) {
  RangeRequest shown = options.shown;
  if (options.scenario == Scenario::range) {
    if (!description.has_every_range) return misuse("'" + url.name + "' has one range, and --scenario range needs a data set of every range");
    if (shown.ranges.size() > 1) return misuse("--range: the clients of --scenario range show one range each");
    if (shown.ranges.empty()) shown.ranges = {upper_half(values_of(description))};
  }
  if (description.has_every_range && shown.ranges.empty()) return misuse("'" + url.name + "' has every range: say which with --range LO HI");
  if (auto held = check_held(description, resolve(description, shown)); !held) return tl::unexpected(held.error());
  return shown;
}

Result<StreamClient> fetch_mesh(const ServerUrl& url, const Lod& lod, const RangeRequest& shown) {
  FetchOptions options;
  options.lod = lod;
  options.shown = shown;
  options.reconnect = std::chrono::seconds(0);
  auto fetched = fetch(url, options, {});
  if (!fetched) return tl::unexpected(fetched.error());
  return std::move(fetched->client);
}

// Each in the range that it shows now, one after the other: see is_mesh_of_range.
Result<Verified> verify_last_ranges(const ServerUrl& url, std::span<const std::optional<LoadedMesh>> meshes) {
  Verified verified;
  for (const auto& mesh : meshes) {
    if (!mesh) continue;
    const Front& front = mesh->client.front();
    const RangeRequest shown{{front.range()}, front.refine()};
    const auto whole = fetch_mesh(url, {}, shown);
    if (!whole) return tl::unexpected(whole.error());
    const auto fresh = fetch_mesh(url, mesh->view, shown);
    if (!fresh) return tl::unexpected(fresh.error());
    ++verified.compared;
    if (!is_mesh_of_range(whole->front(), mesh->is_complete ? &fresh->front() : nullptr, front)) ++verified.differing;
  }
  return verified;
}

// What the run took of the machine, and the figures of all clients.
LoadReport run_plan(const LoadPlan& plan, std::vector<std::optional<LoadedMesh>>& meshes) {
  LoadReport report;
  report.scenario = kScenarios[std::size_t(plan.scenario)];
  report.clients = plan.clients;
  report.threads = std::min(plan.threads, plan.clients);
  const double cpu_before = cpu_seconds(RUSAGE_SELF);
  Share all = run_threads(plan, report.threads, meshes);
  report.stats = std::move(all.stats);
  const std::chrono::duration<double> wall = LoadClock::now() - plan.start;
  report.seconds = std::min<std::chrono::duration<double>>(wall, plan.duration).count();
  report.own_cpu_share = (cpu_seconds(RUSAGE_SELF) - cpu_before) / (wall.count() * std::max(1u, std::thread::hardware_concurrency()));
  report.busiest_thread = all.cpu_seconds / wall.count();
  return report;
}

}  // namespace

Result<LoadReport> run_load(const ServerUrl& url, const LoadOptions& options) {
  if (auto allowed = allow_files(options.clients); !allowed) return tl::unexpected(allowed.error());
  const auto description = describe(url);
  if (!description) return tl::unexpected(description.error());
  const auto shown = shown_by(url, options, *description);
  if (!shown) return tl::unexpected(shown.error());
  const bool drags = options.scenario == Scenario::range;
  std::optional<StreamClient> reference;  // of all clients, if they have one range
  if (options.verify && !drags) {
    auto whole = fetch_mesh(url, {}, *shown);
    if (!whole) return tl::unexpected(whole.error());
    reference = std::move(*whole);
  }
  auto tls = tls_for(url);
  if (!tls) return tl::unexpected(tls.error());
  LoadPlan plan{options, url, std::move(*tls), *description, LoadClock::now() + kStartTime};
  plan.shown = *shown;
  plan.ramp = std::min(plan.ramp, plan.duration);
  std::vector<std::optional<LoadedMesh>> meshes(plan.clients);
  LoadReport report = run_plan(plan, meshes);
  if (!options.verify) return report;
  const Result<Verified> verified = drags ? verify_last_ranges(url, meshes) : verify_meshes(reference->fronts(), meshes, options.seed);
  if (!verified) return tl::unexpected(verified.error());
  report.verified = verified->compared;
  report.differing = verified->differing;
  return report;
}

}  // namespace intervale
