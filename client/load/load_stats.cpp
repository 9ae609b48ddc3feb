#include "client/load/load_stats.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/program/program.h"

namespace intervale {
namespace {

using Json = nlohmann::ordered_json;

// Keeps JSON readable: no digits below the resolution of the clock.
double rounded(double value) { return std::round(value * 1000) / 1000; }

Json to_json(const std::vector<double>& samples) {
  const auto p = percentiles_of(samples);
  if (!p) return {{"p50", nullptr}, {"p95", nullptr}, {"p99", nullptr}, {"max", nullptr}};
  return {{"p50", rounded(p->p50)}, {"p95", rounded(p->p95)}, {"p99", rounded(p->p99)}, {"max", rounded(p->max)}};
}

double per_second(std::uint64_t count, double seconds) { return seconds > 0 ? double(count) / seconds : 0; }

std::uint64_t errors_in(const LoadReport& report) {
  std::uint64_t sum = report.differing;
  for (const auto& [text, count] : report.stats.errors) sum += count;
  return sum;
}

std::string line_of(const char* what, const std::vector<double>& samples, const char* unit) {
  const auto p = percentiles_of(samples);
  if (!p) return fmt::format("{}: none\n", what);
  return fmt::format("{}: {:.1f} {} (median), {:.1f} (95 %), {:.1f} (99 %), {:.1f} at most\n", what, p->p50, unit, p->p95, p->p99, p->max);
}

void append(std::vector<double>& to, std::vector<double>&& from) { to.insert(to.end(), from.begin(), from.end()); }

}  // namespace

std::optional<Percentiles> percentiles_of(std::vector<double> samples) {
  if (samples.empty()) return {};
  const auto rank = [&samples](std::size_t percent) {
    const std::size_t at = (samples.size() * percent + 99) / 100 - 1;  // whole numbers: 0.95 * 20 would be more than 19
    const auto place = samples.begin() + std::ptrdiff_t(at);
    std::nth_element(samples.begin(), place, samples.end());
    return *place;
  };
  return Percentiles{rank(50), rank(95), rank(99), rank(100)};
}

void LoadStats::add(LoadStats&& other) {
  for (const auto member :
       {&LoadStats::connected, &LoadStats::failed, &LoadStats::updates, &LoadStats::bytes, &LoadStats::views, &LoadStats::late_views,
        &LoadStats::unanswered_views, &LoadStats::done_views, &LoadStats::depth_maps, &LoadStats::complete, &LoadStats::protocol_closes,
        &LoadStats::reconnects, &LoadStats::repeated_updates, &LoadStats::repeated_bytes, &LoadStats::resume_bytes}) {
    this->*member += other.*member;
  }
  for (const auto member : {&LoadStats::first_mesh_ms, &LoadStats::first_mesh_bytes, &LoadStats::view_change_ms, &LoadStats::view_done_ms,
                            &LoadStats::view_bytes, &LoadStats::stale_bytes, &LoadStats::set_range_ms, &LoadStats::resume_ms}) {
    append(this->*member, std::move(other.*member));
  }
  for (const auto& [text, count] : other.errors) errors[text] += count;
}

Json to_json(const LoadReport& report) {
  const LoadStats& f = report.stats;
  Json json{{"scenario", report.scenario},
            {"clients", report.clients},
            {"connected", f.connected},
            {"failed", f.failed},
            {"complete", f.complete},
            {"seconds", rounded(report.seconds)},
            {"updates", f.updates},
            {"bytes", f.bytes},
            {"updates_per_s", rounded(per_second(f.updates, report.seconds))},
            {"bytes_per_s", rounded(per_second(f.bytes, report.seconds))},
            {"first_mesh_ms", to_json(f.first_mesh_ms)},
            {"first_mesh_bytes", to_json(f.first_mesh_bytes)},
            {"view_change_ms", to_json(f.view_change_ms)},
            {"view_done_ms", to_json(f.view_done_ms)},
            {"view_bytes", to_json(f.view_bytes)},
            {"stale_bytes", to_json(f.stale_bytes)},
            {"set_range_ms", to_json(f.set_range_ms)},
            {"views", f.views},
            {"done_views", f.done_views},
            {"late_views", f.late_views},
            {"unanswered_views", f.unanswered_views},
            {"depth_maps", f.depth_maps},
            {"threads", report.threads},
            {"own_cpu_share", rounded(report.own_cpu_share)},
            {"busiest_thread", rounded(report.busiest_thread)},
            {"protocol_closes", f.protocol_closes},
            {"reconnects", f.reconnects},
            {"resume_ms", to_json(f.resume_ms)},
            {"resume_bytes", f.resume_bytes},
            {"repeated_updates", f.repeated_updates},
            {"repeated_bytes", f.repeated_bytes}};
  if (report.verified) {
    json["verified"] = *report.verified;
    json["differing"] = report.differing;
  }
  json["errors"] = errors_in(report);
  json["error_texts"] = f.errors;
  return json;
}

std::string to_text(const LoadReport& report) {
  const LoadStats& f = report.stats;
  std::string text = fmt::format("{} of {} clients connected, {} failed, {} complete; {} for {:.1f} s\n", f.connected, report.clients, f.failed,
                                 f.complete, report.scenario, report.seconds);
  text += fmt::format("received {} updates ({:.0f} a second) in {} ({} a second)\n", f.updates, per_second(f.updates, report.seconds),
                      human_bytes(f.bytes), human_bytes(std::uint64_t(per_second(f.bytes, report.seconds))));
  text += line_of("first mesh", f.first_mesh_ms, "ms");
  text += line_of("its bytes", f.first_mesh_bytes, "B");
  text += line_of("view change", f.view_change_ms, "ms");
  text += line_of("view done", f.view_done_ms, "ms");
  text += line_of("bytes of a view", f.view_bytes, "B");
  text += line_of("stale bytes of a view", f.stale_bytes, "B");
  if (!f.set_range_ms.empty()) text += line_of("range of a mesh set", f.set_range_ms, "ms");
  text += fmt::format(
      "{} views, {} served to the end, {} sent late, {} unanswered; this harness took {:.0f} % of the machine, and its busiest thread {:.0f} % of a "
      "core\n",
      f.views, f.done_views, f.late_views, f.unanswered_views, 100 * report.own_cpu_share, 100 * report.busiest_thread);
  if (f.depth_maps > 0) text += fmt::format("{} depth maps sent\n", f.depth_maps);
  if (f.reconnects > 0) {
    text += line_of("resumed within", f.resume_ms, "ms");
    text += fmt::format("{} sessions resumed; {} sent to name the updates of clients; {} updates, and {} in all, received twice\n", f.reconnects,
                        human_bytes(f.resume_bytes), f.repeated_updates, human_bytes(f.repeated_bytes));
  }
  if (report.verified) text += fmt::format("{} meshes compared, {} differ\n", *report.verified, report.differing);
  for (const auto& [what, count] : f.errors) text += fmt::format("{} x {}\n", count, what);
  return text;
}

}  // namespace intervale
