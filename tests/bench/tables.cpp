// The paper's Tables 1 and 2 with our figures beside the paper's, and our speeds, as Markdown.
//
// Weiss and De Floriani 2008, section 8. Table 1: how small. Table 2: selective refinement from Sigma against Delta,
// both on one core. Table 3, ours: how fast it is built, extracted, and taken in by a client.
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <oneapi/tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/core/stream_client.h"
#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/parallel/all_cores.h"
#include "common/selection/stream_plan.h"
#include "common/util/parallel.h"
#include "protocol/limits.h"
#include "server/builder/field_hierarchy.h"
#include "server/volume/samples.h"
#include "tests/bench/cases.h"
#include "tests/bench/delta.h"
#include "tests/bench/paper.h"
#include "tests/bench/timing.h"

namespace intervale::bench {
namespace {

constexpr int kSlowRuns = 3;  // at most, of what takes long

using Sigma = std::shared_ptr<const IntervalVolume>;

struct Query {  // one cell of Table 2
  std::uint64_t delta_updates = 0, sigma_updates = 0, tets = 0;
  double delta_seconds = 0, quick_delta_seconds = 0, sigma_seconds = 0;
  [[nodiscard]] double share() const { return sigma_seconds / delta_seconds; }
  [[nodiscard]] double share_of_quick() const { return sigma_seconds / quick_delta_seconds; }
};

struct Speeds {  // a second; [0] on one core, [1] on two
  std::array<double, 2> built_samples{}, extracted_tets{};
  double applied_updates = 0, shown_updates = 0;  // batches decoded and applied; and then made into a mesh
};

struct Row {
  std::string title;  // name and range
  const PaperSizes* paper = nullptr;
  const PaperTimes* paper_times = nullptr;
  Description description;
  std::size_t memory_bytes = 0, cut_coded_bytes = 0, file_bytes = 0, wire_bytes = 0, delta_bytes = 0;
  std::vector<Query> queries;  // at kErrorPercents
  std::optional<Speeds> speeds;
};

Sigma build(const Case& c) {
  const FieldHierarchy hierarchy(*c.volume, {c.range, c.refine, {}});
  return std::make_shared<const IntervalVolume>(or_throw(hierarchy.compact(c.format)));
}

struct Extracted {
  Mesh mesh;
  std::uint64_t updates = 0;
};
Extracted extract_mesh(const IntervalVolume& volume, double error, const ParallelFor& parallel = serial) {
  Lod lod;
  lod.error = error;
  const auto extraction = or_throw(extract(volume, lod, parallel));
  return {extraction.front.mesh(parallel), extraction.updates};
}
Extracted extract_mesh(const Delta& delta, const Case& c, double error, Delta::Walk walk) {
  const Front front = delta.refine(c.range, c.refine, error, walk);
  return {front.mesh(), front.split_count()};
}

// What a session sends for the full mesh, batch by batch.
std::vector<std::vector<std::uint8_t>> payloads_of(const Sigma& sigma) {
  std::vector<std::vector<std::uint8_t>> payloads;
  StreamPlan plan(sigma);
  plan.set_lod(Lod{});
  std::size_t bytes = 0;
  while (auto batch = plan.next(next_payload(bytes, protocol::kMaxBatchPayload))) {
    bytes += batch->payload.size();
    payloads.push_back(std::move(batch->payload));
  }
  return payloads;
}

std::vector<Query> run_queries(const Case& c, const IntervalVolume& sigma, const Delta& delta, int runs) {
  const tbb::global_control one_core(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<Query> queries;
  for (const double percent : kErrorPercents) {
    const double error = percent / 100 * sigma.description().max_error;
    const auto on_delta = [&] { return extract_mesh(delta, c, error, Delta::Walk::diamonds); };
    const auto on_quick_delta = [&] { return extract_mesh(delta, c, error, Delta::Walk::supercubes); };
    const auto on_sigma = [&] { return extract_mesh(sigma, error); };
    const auto sizes = [](const Extracted& e) { return std::array<std::uint64_t, 3>{e.updates, e.mesh.points.size(), e.mesh.tets.size()}; };
    const auto from_delta = sizes(on_delta()), from_quick_delta = sizes(on_quick_delta()), from_sigma = sizes(on_sigma());
    if (from_delta != from_quick_delta || (error == 0 && from_delta != from_sigma)) {
      throw std::runtime_error(fmt::format("{}: at error {} Delta gives {} or {} updates, vertices, tetrahedra, and Sigma {}", c.name, error,
                                           fmt::join(from_delta, " "), fmt::join(from_quick_delta, " "), fmt::join(from_sigma, " ")));
    }
    const auto times = alternate(runs, on_delta, on_quick_delta, on_sigma);
    queries.push_back({from_delta[0], from_sigma[0], from_sigma[2], times[0], times[1], times[2]});
  }
  return queries;
}

template <class Work>
auto on_cores(std::size_t cores, Work work) {
  return [cores, work] {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, cores);
    return work();
  };
}

Speeds measure_speeds(const Case& c, const Sigma& sigma, int runs) {
  Speeds speeds;
  const Description& d = sigma->description();
  const auto per_second = [](std::uint64_t n, std::array<double, 2> t) { return std::array<double, 2>{double(n) / t[0], double(n) / t[1]}; };
  const auto build_it = [&] { return build(c); };
  speeds.built_samples = per_second(d.grid.sample_count(), alternate(std::min(runs, kSlowRuns), on_cores(1, build_it), on_cores(2, build_it)));
  const auto extract_it = [&] { return extract_mesh(*sigma, 0); };
  const auto extract_in_parallel = [&] { return extract_mesh(*sigma, 0, on_all_cores); };
  speeds.extracted_tets = per_second(d.full.tets, alternate(runs, extract_it, on_cores(2, extract_in_parallel)));

  const auto payloads = payloads_of(sigma);
  const auto receive = [&] {
    StreamClient client = or_throw(StreamClient::start(d));
    for (const auto& payload : payloads) {
      if (auto ok = client.apply(payload); !ok) throw std::runtime_error(ok.error().message);
    }
    return client;
  };
  const auto show = [&] {
    StreamClient client = receive();
    Mesh mesh = client.mesh();
    return std::pair(std::move(client), std::move(mesh));
  };
  const auto shown = per_second(d.updates, alternate(runs, on_cores(1, receive), on_cores(1, show)));
  speeds.applied_updates = shown[0];
  speeds.shown_updates = shown[1];
  return speeds;
}

Row measure(const Case& c, std::shared_ptr<const Delta>& delta, std::shared_ptr<const Volume>& delta_of, int runs) {
  const auto tell = [&](const char* what) { fmt::print(stderr, "{} {}: {}\n", c.name, range_text(c.range, c.refine), what); };
  tell("sizes");
  Row row;
  row.title = c.name + " " + range_text(c.range, c.refine);
  row.paper = paper_sizes(c);
  row.paper_times = paper_times(c);
  const Sigma sigma = build(c);
  row.description = sigma->description();
  row.memory_bytes = sigma->memory_bytes();
  row.cut_coded_bytes = row.memory_bytes + row.description.updates + row.description.coefficients - sigma->keys().bytes().size();
  row.file_bytes = encode_ivm(*sigma).size();
  for (const auto& payload : payloads_of(sigma)) row.wire_bytes += payload.size();
  if (runs == 0) return row;
  if (delta_of != c.volume) {
    tell("Delta");
    delta.reset();
    delta = make_delta(*c.volume, c.format);
    delta_of = c.volume;
  }
  row.delta_bytes = delta->memory_bytes() + c.volume->bytes.size();
  tell("queries");
  row.queries = run_queries(c, *sigma, *delta, runs);
  tell("speeds");
  row.speeds = measure_speeds(c, sigma, runs);
  return row;
}

// "45.1 K", "1.66 M"; as the paper writes them.
std::string count(double n) {
  if (n < 1000) return fmt::format("{:.0f}", n);
  const bool large = n >= 999.5e3;
  const double value = n / (large ? 1e6 : 1e3);
  return fmt::format("{:.{}f} {}", value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0, large ? "M" : "K");
}

std::string size_text(double bytes) {
  if (bytes < 999.5e3) return fmt::format("{:.0f} kB", bytes / 1e3);
  return fmt::format("{:.{}f} MB", bytes / 1e6, bytes < 9.995e6 ? 2 : 1);
}

void print_sizes(const std::vector<Row>& rows) {
  fmt::print(
      "## Table 1: sizes\n\n"
      "| volume, range | samples | coefficients | updates | full mesh: vertices | tetrahedra | indexed | in memory | with cuts | as a file | on the "
      "wire |\n"
      "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& r : rows) {
    const Description& d = r.description;
    const auto indexed = double(d.full.indexed_bytes());
    const auto size = [&](std::size_t bytes) {
      return fmt::format("{}, {:.{}f} ×", size_text(double(bytes)), indexed / double(bytes), indexed / double(bytes) < 9.95 ? 1 : 0);
    };
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", r.title, count(double(d.grid.sample_count())),
               count(double(d.coefficients)), count(double(d.updates)), count(double(d.full.vertices)), count(double(d.full.tets)),
               size_text(indexed), size(r.memory_bytes), size(r.cut_coded_bytes), size(r.file_bytes), size(r.wire_bytes));
    if (const PaperSizes* p = r.paper) {
      fmt::print("| *the paper's {}* | | *{}* | *{}* | *{}* | *{}* | *{} MB* | *{} MB, {} ×* | | | |\n", p->title, count(p->coefficients),
                 count(p->updates), count(p->vertices), count(p->tets), p->indexed_mb, p->compact_mb, p->ratio);
    }
  }
  fmt::print(
      "\nIndexed: 12 bytes a vertex, 16 bytes a tetrahedron. In memory, as a file: `memory_bytes` and `file_bytes` of\n"
      "`intervale build --json`. On the wire: the payloads of all batches of a session that is never held up, which ends with\n"
      "the full mesh. `bytes_received` of `intervale-client fetch` is a few percent more, because a busy network or server\n"
      "makes smaller batches. The wire is smaller than the file because a client needs no errors. Coefficients: the cuts of all\n"
      "updates. An update here holds the value at the centre and no cuts: they are computed from the values when they are asked\n"
      "for. With cuts: the bytes in memory if an update held the side of its centre and its cuts instead, as the paper's do: a\n"
      "byte each. The rows of the paper are its own coding, in memory, of its own copies of the volumes.\n");
}

void print_queries(const std::vector<Row>& rows) {
  fmt::print(
      "\n## Table 2: queries, Σ against Δ\n\n"
      "| volume, range | error | updates: Δ | Σ | tetrahedra | ms: Δ | Δ by supercubes | Σ | Σ / Δ | Σ / Δ by supercubes | the paper's Σ / Δ |\n"
      "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& r : rows) {
    for (std::size_t i = 0; i < r.queries.size(); ++i) {
      const Query& q = r.queries[i];
      const PaperTimes* p = r.paper_times;
      fmt::print("| {} | {} % | {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {} |\n", i == 0 ? r.title : "", kErrorPercents[i],
                 q.delta_updates, q.sigma_updates, q.tets, 1e3 * q.delta_seconds, 1e3 * q.quick_delta_seconds, 1e3 * q.sigma_seconds, q.share(),
                 q.share_of_quick(), p == nullptr ? "" : fmt::format("*{:.2f}*", p->sigma[i] / p->delta[i]));
    }
  }
  fmt::print("\n| volume, range | memory of Δ | of Σ | mean of Σ / Δ | of Σ / Δ by supercubes | the paper's |\n|---|--:|--:|--:|--:|--:|\n");
  double sum = 0, sum_of_quick = 0;
  for (const Row& r : rows) {
    double mean = 0, mean_of_quick = 0;
    for (const Query& q : r.queries) {
      mean += q.share() / double(r.queries.size());
      mean_of_quick += q.share_of_quick() / double(r.queries.size());
    }
    sum += mean;
    sum_of_quick += mean_of_quick;
    fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {} |\n", r.title, size_text(double(r.delta_bytes)), size_text(double(r.memory_bytes)), mean,
               mean_of_quick, r.paper_times == nullptr ? "" : fmt::format("*{:.2f}*", r.paper_times->mean));
  }
  const auto n = double(rows.size());
  fmt::print("| **all** | | | **{:.2f}** | **{:.2f}** | *{:.2f}* |\n", sum / n, sum_of_quick / n, kPaperMean);
  fmt::print(
      "\nError: percent of the largest. One core; from the query to the indexed mesh. Δ descends diamond by diamond, as the\n"
      "paper's queries do. Δ by supercubes descends and splits the front by supercubes as Σ does: the part of Σ's advantage\n"
      "that comes from supercubes. Δ computes its updates from samples: their keys, for the front derives sides and cuts. Δ\n"
      "saturates errors over all children. Σ saturates them over relevant children and rounds them up to one of {} levels. Σ\n"
      "counts the updates that its mesh shows: not those whose vertices and centre lie on one side, unless a finer one is\n"
      "shown. Hence the updates that differ. At error 0 both produce the same mesh.\n",
      kMaxErrorSteps);
}

void print_speeds(const std::vector<Row>& rows) {
  fmt::print(
      "\n## Table 3: speeds\n\n"
      "| volume, range | build, M samples/s: 1 core | 2 cores | 2 / 1 | extract, M tetrahedra/s: 1 core | 2 cores | 2 / 1 | "
      "client, M updates/s: applied | and meshed |\n"
      "|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& r : rows) {
    if (!r.speeds) continue;
    const Speeds& s = *r.speeds;
    const auto two = [](const std::array<double, 2>& v) { return fmt::format("{:.2f} | {:.2f} | {:.2f}", v[0] / 1e6, v[1] / 1e6, v[1] / v[0]); };
    fmt::print("| {} | {} | {} | {:.2f} | {:.2f} |\n", r.title, two(s.built_samples), two(s.extracted_tets), s.applied_updates / 1e6,
               s.shown_updates / 1e6);
  }
  fmt::print(
      "\nBuild: from samples in memory to the interval volume. Extract: error 0, from the interval volume to the indexed mesh.\n"
      "Client, one core: all batches of the full mesh, decoded and applied one after the other; the same, and then an indexed\n"
      "mesh made.\n");
}

int run(int argc, char** argv) {
  CLI::App app("Prints the paper's Tables 1 and 2 with our figures beside the paper's, and our speeds, as Markdown", "bench_tables");
  std::vector<std::string> volumes, samples{sample_names().begin(), sample_names().end()};
  int size = 129, runs = 5;
  app.add_option("--volume", volumes, fmt::format("A volume and a range: {}. May be given again", kCaseSyntax))
      ->type_name("CASE")
      ->allow_extra_args(false);
  app.add_option("--samples", samples, fmt::format("The product's own samples to measure: {}; none", fmt::join(sample_names(), ", ")))
      ->capture_default_str();
  app.add_option("--size", size, "Samples a side of those")->capture_default_str();
  app.add_option("--runs", runs, "Runs, of which the medians are shown; 0: sizes only")->capture_default_str()->check(CLI::Range(0, 1000));
  CLI11_PARSE(app, argc, argv);
  if (samples == std::vector<std::string>{"none"}) samples.clear();
  std::vector<Row> rows;
  rows.reserve(volumes.size() + samples.size());
  std::shared_ptr<const Delta> delta;
  std::shared_ptr<const Volume> delta_of;
  for (const auto& text : volumes) rows.push_back(measure(or_throw(read_case(text)), delta, delta_of, runs));
  for (const auto& name : samples) rows.push_back(measure(or_throw(sample_case(name, size)), delta, delta_of, runs));
  if (rows.empty()) return 0;
  print_sizes(rows);
  if (runs == 0) return 0;
  print_queries(rows);
  print_speeds(rows);
  return 0;
}

}  // namespace
}  // namespace intervale::bench

int main(int argc, char** argv) { return intervale::bench::run_or_report("bench_tables", intervale::bench::run, argc, argv); }
