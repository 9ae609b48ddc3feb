// What many clients need of servers that keep pages of files in a cache, and what they would need without a server.
//
// Sessions are recorded: the product's own, over real files, with the cameras and drags of intervale-load, by clients that
// read as fast as they are sent to. Then a model (scaling.h) replays them for many clients. deploy/SCALING.md has the
// results.
#include "tests/bench/scaling.h"

#include <fmt/core.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/core/client_session.h"
#include "client/load/camera_paths.h"
#include "client/load/range_path.h"
#include "common/codec/batch.h"
#include "common/codec/split_names.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_page.h"
#include "protocol/codec.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"
#include "tests/bench/cases.h"

namespace intervale::bench {
namespace {

using Volume = std::shared_ptr<const IntervalVolume>;

constexpr std::uint32_t kMostDragged = 5'000'000;  // updates of a data set whose ranges are dragged: more take minutes to record

struct Options {
  std::vector<std::string> files;
  std::uint32_t users = 4, seconds = 60, data_sets = 10000, warm_up = 30, measured = 30;
  std::vector<std::uint32_t> clients{100'000, 10'000, 1'000'000};
  std::vector<double> cache_mib{4096, 1024, 16384};
  double views_per_second = 5, pixel_error = 2, exponent = 0.9;
  double cores = 16, load = 0.6, connection_kib = 72, io_ms = 1;
  double core_hour = 0.04, gb_hour = 0.005, gb_egress = 0.05, gets = 0.004;
};

double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// Of processor time.
template <class Work>
double cpu_seconds(Work&& work) {
  const double start = thread_seconds();
  work();
  return thread_seconds() - start;
}

// The pages of a volume's file, and which of them a batch's updates are in.
class Pages {
 public:
  explicit Pages(const SupercubeSet& set) : pages_(pages_of(set)) {
    for (std::uint32_t page = 0; page < pages_.size(); ++page) {
      for (const BrickRun& block : pages_[page]) page_of_.emplace(block_of(set.bricks()[block.first].key), page);
    }
    needs_.resize(pages_.size());
    for (const auto& [block, page] : page_of_) need_coarser(block, needs_[page]);
  }
  [[nodiscard]] std::vector<std::uint32_t> values(const SupercubeSet& set) const {
    std::vector<std::uint32_t> values(pages_.size());
    for (std::size_t page = 0; page < pages_.size(); ++page) {
      for (const BrickRun& block : pages_[page]) {
        for (BrickIndex b = block.first; b < block.end; ++b) values[page] += set.updates(b);
      }
    }
    return values;
  }
  // Adds the pages of a batch, and those without which they cannot be decoded.
  void add(std::span<const std::uint8_t> payload, std::set<std::uint32_t>& to) const {
    RangeDecoder coder(payload);
    const bool is_plain = coder.raw_bits(1) != 0;
    for (const SupercubeKey key : or_throw(decode_supercubes(coder, is_plain, kBatchUpdatesMost))) {
      const std::uint32_t page = page_of_.at(block_of(key));
      if (to.insert(page).second) to.insert(needs_[page].begin(), needs_[page].end());
    }
  }

 private:
  // Blocks of coarser scales with points of a block's lattice, which goes from -1 to 64.
  void need_coarser(BlockKey block, std::set<std::uint32_t>& to) const {
    const SupercubeKey key = block << kBlockBits;
    const Vertex p = position_of_key(key);
    for (int scale = scale_of_key(key) + 1, shift = 1; scale < kMaxLevels; ++scale, ++shift) {
      const auto first = [&](std::int32_t c) { return std::max(4 * c - 1, 0) >> (6 + shift); };
      const auto last = [&](std::int32_t c) { return (4 * c + 64) >> (6 + shift); };
      for (std::int32_t z = first(p.z); z <= last(p.z); ++z) {
        for (std::int32_t y = first(p.y); y <= last(p.y); ++y) {
          for (std::int32_t x = first(p.x); x <= last(p.x); ++x) {
            const auto found = page_of_.find(block_of(supercube_key(scale, {16 * x, 16 * y, 16 * z})));
            if (found != page_of_.end()) to.insert(found->second);
          }
        }
      }
    }
  }
  std::vector<ValuePage> pages_;
  boost::unordered_flat_map<BlockKey, std::uint32_t> page_of_;
  std::vector<std::set<std::uint32_t>> needs_;  // by page
};

// What sessions begin with.
RangeRequest first_shown(const Description& d) {
  RangeRequest shown;
  if (d.has_every_range) shown.ranges = {upper_half(values_of(d))};
  return shown;
}

// One user, from the first view on. A view that takes longer than until the next one is given up, and those due before
// that are skipped, as servers do.
Recording record(const Volume& volume, const Pages& pages, LocalWorker& worker, Scenario scenario, std::uint64_t seed, const Options& options) {
  const Description& d = volume->description();
  const CameraPath path{
      .scenario = scenario, .box = box_of(d.grid), .pixel_error = options.pixel_error, .views_per_second = options.views_per_second, .seed = seed};
  const RangePath drag{upper_half(values_of(d)), values_of(d), seed};
  Recording recording;
  recording.seconds.resize(options.seconds);
  std::set<std::uint32_t> known;
  SessionState state([&](const std::string&) { return volume; }, worker);
  const auto say = [&](const protocol::ClientMessage& message) {
    if (const auto fault = state.receive(message)) throw std::runtime_error(fault->text);
  };
  say(protocol::Open{.dataset = d.name, .client = "bench_scaling", .credit = protocol::kMaxWindow});
  const auto due = [&](std::uint64_t number) {
    return double(number) / options.views_per_second + (scenario == Scenario::range ? rests_before(number) : 0);
  };
  double now = 0;
  for (std::uint64_t number = 0; due(number) < options.seconds; ++number) {
    if (due(number + 1) <= now) continue;
    now = std::max(now, due(number));
    Second& second = recording.seconds[std::min<std::size_t>(std::size_t(now), options.seconds - 1)];
    protocol::View view{.epoch = number + 1, .lod = view_of(path, number)};
    view.shown = first_shown(d);
    if (scenario == Scenario::range) view.shown.ranges = {range_of(drag, number)};
    view.early = scenario == Scenario::range;
    if (view.early) view.coarse_error_percent = kCoarseErrorPercent;
    std::set<std::uint32_t> read(second.pages.begin(), second.pages.end());
    const auto spend = [&](double seconds) {
      second.cpu_seconds += seconds;
      now += seconds;
    };
    spend(cpu_seconds([&] { say(view); }));
    while (now < due(number + 1)) {
      std::optional<protocol::ServerMessage> message;
      bool goes_on = false;
      spend(cpu_seconds([&] {
        message = state.next();
        if (message) second.bytes += double(protocol::encode(*message).size());
        goes_on = message || state.has_work() || (state.waits() && worker.work());
      }));
      if (!goes_on) break;
      const auto* batch = message ? std::get_if<protocol::Batch>(&*message) : nullptr;
      if (!batch) continue;
      second.updates += batch->updates;
      if (!batch->payload.empty()) pages.add(batch->payload, read);
      say(protocol::Credit{cost_of(*batch)});
    }
    second.pages.assign(read.begin(), read.end());
    for (const std::uint32_t page : read) {
      if (known.insert(page).second) second.firsts.push_back(page);
    }
  }
  recording.memory_bytes = double(state.memory_bytes());
  return recording;
}

void print_session(const std::string& name, Scenario scenario, const std::vector<Recording>& users) {
  Second sum;
  double firsts = 0, reads = 0, memory = 0, seconds = 0;
  for (const Recording& user : users) {
    for (const Second& s : user.seconds) {
      sum.cpu_seconds += s.cpu_seconds, sum.bytes += s.bytes, sum.updates += s.updates;
      firsts += double(s.firsts.size()), reads += double(s.pages.size());
    }
    memory += user.memory_bytes, seconds += double(user.seconds.size());
  }
  const auto n = double(users.size());
  fmt::print("| {} | {} | {:.2f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.0f} |\n", name, kScenarios[std::size_t(scenario)],
             1e3 * sum.cpu_seconds / seconds, sum.bytes / n / 1e3, double(sum.updates) / n / 1e3, firsts / n, reads / seconds, memory / n / 1024);
  std::fflush(stdout);
}

// Milliseconds to rank all bricks for a view.
double view_ms(const Volume& volume, const Options& options) {
  StreamPlan plan(volume);
  const CameraPath path{.box = box_of(volume->description().grid), .pixel_error = options.pixel_error};
  constexpr int kViews = 20;
  const double seconds = cpu_seconds([&] {
    for (std::uint64_t k = 0; k < kViews; ++k) plan.set_lod(view_of(path, k));
  });
  return 1e3 * seconds / kViews;
}

Template record_all(const std::string& file, const Options& options, std::string& facts) {
  Template to;
  const auto bytes = or_throw(read_volume_file(file));
  const Container container = or_throw(Container::open(bytes, *scope_of(bytes)));
  const auto index = container[StreamType::page_index];
  for (std::size_t at = 0; at < index.size(); at += 16) {
    std::uint64_t size = 0;
    std::memcpy(&size, index.data() + at, sizeof size);
    to.page_bytes.push_back(std::uint32_t(size));
  }
  to.head_bytes = double(bytes.size() - container[StreamType::pages].size());
  const std::string name = std::filesystem::path(file).stem().string();
  Volume volume;
  const double decoding = cpu_seconds([&] { volume = std::make_shared<const IntervalVolume>(or_throw(decode_volume(bytes, name))); });
  const Pages pages(volume->set());
  to.page_values = pages.values(volume->set());
  if (to.page_values.size() != to.page_bytes.size()) throw std::runtime_error(file + ": its pages are not those of its set");
  const double ms = view_ms(volume, options);
  // As servers do, it keeps what was measured of ranges for other sessions. That of the range where sessions begin is
  // not counted.
  LocalWorker worker(std::size_t(256) << 20);
  const auto measured = worker.ask(volume, resolve(volume->description(), first_shown(volume->description())), Distances::measured);
  while (worker.work()) continue;
  for (const Scenario scenario : {Scenario::orbit, Scenario::zoom, Scenario::jump, Scenario::range}) {
    if (scenario == Scenario::range && (!volume->description().has_every_range || volume->size() > kMostDragged)) continue;
    std::vector<Recording> users;
    for (std::uint64_t seed = 1; seed <= options.users; ++seed) users.push_back(record(volume, pages, worker, scenario, seed, options));
    print_session(name, scenario, users);
    std::vector<Recording>& of = scenario == Scenario::range ? to.drags : to.users;
    of.insert(of.end(), users.begin(), users.end());
  }
  const double values = double(volume->size());
  to.bytes_a_value = double(volume->memory_bytes()) / values;
  to.seconds_a_value = decoding / values;
  facts += fmt::format("| {} | {:.2f} | {:.2f} | {} | {:.2f} | {:.2f} | {:.1f} | {:.1f} | {:.3f} | {:.0f} |\n", name,
                       double(volume->description().grid.sample_count()) / 1e6, values / 1e6, to.page_bytes.size(), double(bytes.size()) / 1e6,
                       to.bytes_a_value, 1e-6 / to.seconds_a_value, double(volume->set().bricks().size()) / 1e3, ms,
                       1e6 * ms / double(volume->set().bricks().size()));
  return to;
}

// Of a core each second, on average.
double seconds_of_cpu(const std::vector<Recording>& users, const Options& options) {
  double sum = 0;
  for (const Recording& user : users) {
    for (const Second& s : user.seconds) sum += s.cpu_seconds;
  }
  return sum / double(users.size()) / options.seconds;
}

double session_bytes(const std::vector<Template>& templates, const Options& options) {
  double sum = 0;
  for (const Template& t : templates) {
    double of_users = 0;
    for (const Recording& user : t.users) of_users += user.memory_bytes;
    sum += of_users / double(t.users.size());
  }
  return sum / double(templates.size()) + 1024 * options.connection_kib;
}

void print_row(const Crowd& s, const std::vector<Template>& templates, const Options& o) {
  constexpr std::array kNames{"random", "hashed", "spread"};
  const Rates r = simulate(s, templates);
  const double cores = (r.cpu + r.decoding + s.clients * o.io_ms / 1e3) / o.load;
  const double sessions = s.clients * session_bytes(templates, o), caches = double(s.cache_bytes) * s.replicas;
  const double of_cores = cores * o.core_hour, of_memory = (sessions + caches) / 1e9 * o.gb_hour, of_gets = r.misses * 3600 / 1e4 * o.gets,
               of_bytes = r.bytes * 3600 / 1e9 * o.gb_egress, thousands = s.clients / 1e3;
  fmt::print(
      "| {} | {} | {} | {:.2f} | {:.1f} | {:.0f} | {:.1f} | {:.1f} + {:.1f} | {:.2f} | {:.0f} | {:.1f} | {:.3f} + {:.3f} + {:.3f} + {:.3f} |\n",
      s.clients, s.replicas, kNames[std::size_t(s.routing)], double(s.cache_bytes) / double(1 << 30), 100 * (1 - r.misses / std::max(1.0, r.reads)),
      cores, r.fullest, sessions / 1e9, r.cached_bytes / 1e9, 8 * r.bytes / 1e9, r.misses, r.miss_bytes / 1e6, of_cores / thousands,
      of_memory / thousands, of_bytes / thousands, of_gets / thousands);
  std::fflush(stdout);
}

// Static files alone: whole, or by pages.
void print_without_server(const std::vector<Template>& templates, const Options& o) {
  double whole = 0, bytes = 0, gets = 0, streamed = 0;
  for (const Template& t : templates) {
    double pages = 0;
    for (const std::uint32_t page : t.page_bytes) pages += page;
    whole += t.head_bytes + pages;
    bytes += t.head_bytes;
    double users = 0, sent = 0, requests = 0, read = 0;
    for (const Recording& user : t.users) {
      ++users;
      for (const Second& s : user.seconds) {
        sent += s.bytes, requests += double(s.firsts.size());
        for (const std::uint32_t page : s.firsts) read += t.page_bytes[page];
      }
    }
    streamed += sent / users, gets += 1 + requests / users, bytes += read / users;
  }
  const double n = double(templates.size()), sessions = 1e3 * 3600 / o.seconds;  // of 1,000 clients in an hour
  const auto row = [&](const char* name, double requests, double size) {
    fmt::print("| {} | {:.1f} | {:.2f} | {:.2f} + {:.3f} |\n", name, requests, size / 1e6, sessions * size / 1e9 * o.gb_egress,
               sessions * requests / 1e4 * o.gets);
  };
  fmt::print("\n| a session | requests | MB | an hour of 1,000 clients: egress + requests |\n|---|--:|--:|--:|\n");
  row("by a server", 0, streamed / n);
  row("files, by page", gets / n, bytes / n);
  row("files, whole", 1, whole / n);
}

int run(int argc, char** argv) {
  Options o;
  CLI::App app("Records sessions over .ivm files, and models many clients that replay them; tables in Markdown", "bench_scaling");
  app.add_option("FILES", o.files, ".ivm files, of which the data sets of the model are copies")->required();
  app.add_option("--users", o.users, "Sessions recorded for each file and scenario")->capture_default_str();
  app.add_option("--seconds", o.seconds, "Of each session")->capture_default_str();
  app.add_option("--views-per-second", o.views_per_second, "Of each session, while it moves")->capture_default_str();
  app.add_option("--pixel-error", o.pixel_error, "Of the views")->capture_default_str();
  app.add_option("--clients", o.clients, "At any time; may be several numbers: the first is for all routings")->capture_default_str();
  app.add_option("--warm-up", o.warm_up, "Seconds of the model that are not counted")->capture_default_str();
  app.add_option("--measured", o.measured, "Seconds of the model that are")->capture_default_str();
  app.add_option("--data-sets", o.data_sets, "In the store")->capture_default_str();
  app.add_option("--zipf", o.exponent, "Exponent of their popularity")->capture_default_str();
  app.add_option("--cache", o.cache_mib, "MiB of pages, decoded, of each replica; the others for the first number of clients and spread routing only")
      ->capture_default_str();
  app.add_option("--cores", o.cores, "Of a replica")->capture_default_str();
  app.add_option("--load", o.load, "Share of the cores that is used")->capture_default_str();
  app.add_option("--connection", o.connection_kib, "KiB of a session besides its stream plan")->capture_default_str();
  app.add_option("--io", o.io_ms, "Milliseconds of a core that a client takes each second besides what is recorded")->capture_default_str();
  app.add_option("--core-hour", o.core_hour, "Price of a core for an hour")->capture_default_str();
  app.add_option("--gb-hour", o.gb_hour, "Of a GB of memory for an hour")->capture_default_str();
  app.add_option("--gb-egress", o.gb_egress, "Of a GB sent to clients")->capture_default_str();
  app.add_option("--gets", o.gets, "Of 10,000 requests to the store")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  fmt::print("| sessions | scenario | ms of a core each second | kB | k updates | pages | pages read each second | KiB of the plan |\n");
  fmt::print("|---|---|--:|--:|--:|--:|--:|--:|\n");
  std::vector<Template> templates;
  std::string facts;
  for (const std::string& file : o.files) templates.push_back(record_all(file, o, facts));
  fmt::print(
      "\n| file | M samples | M updates | pages | MB | bytes an update in memory | M updates/s decoded | k bricks | ms a view | ns a brick |\n");
  fmt::print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n{}", facts);

  double cpu = 0;  // of a client each second
  for (const Template& t : templates) cpu += seconds_of_cpu(t.users, o) / double(templates.size());
  fmt::print("\n| clients | replicas | routing | GiB of cache each | % hits | cores | fullest / mean | GB: sessions + pages | Gbit/s to clients ");
  fmt::print("| reads/s of the store | MB/s | an hour of 1,000 clients: cores + memory + egress + requests |\n");
  fmt::print("|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const std::uint32_t clients : o.clients) {
    const auto replicas = std::uint32_t(std::ceil(clients * (cpu + o.io_ms / 1e3) / (o.cores * o.load)));
    for (const Routing routing : {Routing::random, Routing::hashed, Routing::spread}) {
      for (const double mib : o.cache_mib) {
        const bool is_first = mib == o.cache_mib.front();
        if (clients == o.clients.front() ? routing != Routing::spread && !is_first : routing != Routing::spread || !is_first) continue;
        const auto cache = std::uint64_t(mib * 1024 * 1024);
        print_row({clients, replicas, o.data_sets, o.exponent, routing, cache, o.warm_up, o.measured}, templates, o);
      }
    }
  }
  print_without_server(templates, o);
  for (Template& t : templates) t.users.insert(t.users.end(), t.drags.begin(), t.drags.end());
  double with_drags = 0, sessions = 0;
  for (const Template& t : templates) {
    with_drags += seconds_of_cpu(t.users, o) / double(templates.size());
    sessions += double(t.drags.size()) / double(t.users.size()) / double(templates.size());
  }
  fmt::print("\nIf {:.1f} % of the sessions drag a range, a client takes {:.1f} ms of a core each second instead of {:.1f}.\n", 100 * sessions,
             1e3 * with_drags, 1e3 * cpu);
  return 0;
}

}  // namespace
}  // namespace intervale::bench

int main(int argc, char** argv) { return intervale::bench::run_or_report("bench_scaling", intervale::bench::run, argc, argv); }
