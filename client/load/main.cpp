// The command line of intervale-load.
#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/load/load_run.h"
#include "client/program/access_options.h"
#include "common/program/range_option.h"
#include "protocol/limits.h"

namespace intervale {
namespace {

struct LoadCommand {
  std::string url;
  Access access;
  LoadOptions load;
  std::vector<std::string> range;
  std::optional<std::string> refine;
  bool json = false;
};

// An error if clients failed, with the most frequent reason, or if meshes differ.
Result<void> check_report(const LoadReport& report) {
  const LoadStats& stats = report.stats;
  if (stats.failed > 0) {
    const auto most = std::ranges::max_element(stats.errors, {}, [](const auto& error) { return error.second; });
    const std::string why = most == stats.errors.end() ? std::string() : ": " + most->first;
    return fail(fmt::format("{} of {} clients failed{}", stats.failed, report.clients, why));
  }
  if (report.differing > 0) return fail(fmt::format("{} of {} meshes differ from the reference", report.differing, report.verified.value_or(0)));
  return {};
}

Result<void> run(const LoadCommand& options) {
  const auto url = parse_url(options.url, options.access);
  if (!url) return tl::unexpected(url.error());
  if (url->name.empty()) return misuse("the URL names no data set: expected " + url->server() + "/NAME; see intervale-client list " + url->server());
  const auto ranges = parse_ranges(options.range);
  if (!ranges) return tl::unexpected(ranges.error());
  if (options.load.depth_maps && options.load.scenario == Scenario::full)
    return misuse("--depth-maps tells what a camera sees, and the clients of --scenario full have none");
  LoadOptions load = options.load;
  load.shown = {*ranges, parse_refine(options.refine)};
  const auto report = run_load(*url, load);
  if (!report) return tl::unexpected(with_access_hint(report.error(), *url));
  if (auto printed = options.json ? print_json(to_json(*report)) : print(to_text(*report)); !printed) return printed;
  return check_report(*report);
}

// Refuses "nan" and "inf", which the parser reads as numbers, and -1, which it converts to a large unsigned number.
CLI::Option* within(CLI::Option* option, double least, double most, const std::string& unit) {
  return option
      ->check([least, most](const std::string& text) {
        double value = 0;
        if (!CLI::detail::lexical_cast(text, value) || !(value >= least && value <= most))
          return fmt::format("must be {:.10g} to {:.10g}", least, most);
        return std::string();
      })
      ->type_name(unit);
}

// time: a duration, or an optional one.
template <class Time>
CLI::Option* add_seconds(CLI::App& app, const std::string& name, Time& time, double least, const std::string& description) {
  const auto set = [&time](double seconds) { time = std::chrono::duration_cast<LoadClock::duration>(std::chrono::duration<double>(seconds)); };
  return within(app.add_option_function<double>(name, set, description), least, 1e6, "SECONDS");
}

void add_view_options(CLI::App& app, LoadOptions& load) {
  const auto group = "Views";
  const auto number_of = [](const std::string& name) { return std::size_t(std::ranges::find(kScenarios, name) - kScenarios.begin()); };
  app.add_option_function<std::string>(
         "--scenario", [&load, number_of](const std::string& name) { load.scenario = Scenario(number_of(name)); },
         "full: the whole stream, once; orbit (default): around the box; zoom: to a point on the box and back; jump: to a random place with "
         "each view; range: drags the ends of the range, in a data set of every range")
      ->check(
          [=](const std::string& name) { return std::string(number_of(name) < kScenarios.size() ? "" : "must be full, orbit, zoom, jump or range"); })
      ->type_name("full|orbit|zoom|jump|range")
      ->group(group);
  within(app.add_option("--views-per-second", load.views_per_second, "Views that each client sends a second; in range while it drags; not for full")
             ->capture_default_str(),
         0.001, 1000, "N")
      ->group(group);
  within(app.add_option("--pixel-error", load.pixel_error,
                        "Error of the surfaces that clients accept on a screen of 1920 x 1080, in pixels; less is more load")
             ->capture_default_str(),
         0.001, 10000, "PX")
      ->group(group);
  within(app.add_option("--seed", load.seed, "Seed of the cameras and of the drags: equal seeds give equal views")->capture_default_str(), 0,
         9007199254740992.0, "N")
      ->group(group);
}

void add_connection_options(CLI::App& app, LoadOptions& load) {
  const auto group = "Connections";
  add_seconds(app, "--ramp", load.ramp, 0, "The clients connect spread evenly over this time (default 1, or the duration if that is less)")
      ->group(group);
  add_seconds(app, "--patience", load.patience, 0.1, "Longest time to connect, and to open the WebSocket; then the client has failed (default 10)")
      ->group(group);
  within(app.add_option("--rate", load.rate, "Most bytes a second that each client reads (default: no limit)"), 1024, 1e12, "BYTES_PER_S")
      ->group(group);
  within(app.add_option(
             "--window", load.window,
             "Most outstanding credit of each client, in bytes: so much of an older view may still arrive (default: adapts to the connection)"),
         4 * double(protocol::kMinCredit), double(protocol::kMaxWindow), "BYTES")
      ->group(group);
  within(app.add_option("--threads", load.threads, "Threads that run the clients (default: half of the cores)"), 1, 256, "N")->group(group);
}

void add_options(CLI::App& app, LoadCommand& options) {
  LoadOptions& load = options.load;
  load.threads = std::max(1u, std::thread::hardware_concurrency() / 2);
  app.add_option("URL", options.url, "ws://host:port/NAME, or wss://")->required();
  within(app.add_option("--clients", load.clients, "Number of clients that run at once")->required(), 1, 1e6, "N");
  add_seconds(app, "--duration", load.duration, 0.01, "How long views are sent")->required();
  add_seconds(app, "--grace", load.grace, 0, "After the duration: how long answers are awaited (default 2)");
  add_ranges_option(app, options.range, std::string(kShownRangeHelp) + ". Scenario range: where drags begin (default: the upper half of the values)")
      ->group("Views");
  add_refine_option(app, options.refine, kShownRefineHelp)->group("Views");
  add_view_options(app, load);
  add_connection_options(app, load);
  const auto verify = app.add_flag("--verify", load.verify,
                                   "Apply the batches, and compare every mesh with that of the whole stream, or in range of the stream of its last "
                                   "range; takes the memory of a mesh for each client");
  within(app.add_option("--max-tets", load.budget.max_tets,
                        "With --verify: most tetrahedra of each mesh; it keeps what is largest on the client's screen"),
         0, 1e15, "N")
      ->needs(verify);
  within(
      app.add_option("--max-kept", load.budget.max_updates,
                     "With --verify: most updates that each client keeps, some 15 bytes each; it gives up the least important ones, and the server "
                     "sends them again when needed"),
      0, 1e15, "N")
      ->needs(verify);
  app.add_flag("--depth-maps", load.depth_maps,
               "With --verify: each client tells the server what its mesh hides, as the viewer does, for it to send that last; takes up to a fifth "
               "of a second of a core for each map. Not for full")
      ->needs(verify);
  add_seconds(app, "--reconnect", load.reconnect, 0.1,
              "With --verify: how long a client tries to reach a lost server again, to resume (default: the client has failed)")
      ->needs(verify);
  add_access_options(app, options.access);
  add_json_flag(app, options.json);
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) {
  intervale::Program program("intervale-load", "Runs many clients that change their views, and measures what a server sends them");
  intervale::LoadCommand options;
  intervale::add_options(program.only_command([&options] { return intervale::run(options); }), options);
  return program.run(argc, argv);
}
