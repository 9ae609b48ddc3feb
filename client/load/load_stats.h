// What a load run measures, and how it is printed.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace intervale {

// Percentiles by nearest rank: the smallest sample that at least so many percent of all samples do not exceed.
struct Percentiles {
  double p50 = 0, p95 = 0, p99 = 0, max = 0;
};
// Off if there are no samples. O(samples).
[[nodiscard]] std::optional<Percentiles> percentiles_of(std::vector<double> samples);

// Of one client, of the clients of one thread, or of a whole run. Every sample is kept, 8 bytes each: a client with
// five views a second takes 0.3 MB an hour.
struct LoadStats {
  std::uint64_t connected = 0;  // clients whose first WebSocket was opened
  std::uint64_t failed = 0;     // clients that did not last to the end
  std::uint64_t updates = 0;    // received within the duration, by all clients
  std::uint64_t bytes = 0;      // of messages, likewise, without WebSocket framing
  std::uint64_t views = 0;      // sent, or skipped because the next one was due already
  // Sent more than kLate after they were due: the harness or the connection is too slow.
  std::uint64_t late_views = 0;
  std::uint64_t unanswered_views = 0;  // at the end; view_change_ms has the time that they waited
  std::uint64_t done_views = 0;        // Done messages, but for a second one for the same view
  std::uint64_t depth_maps = 0;        // sent
  std::uint64_t complete = 0;          // clients that received all of their last view
  std::uint64_t protocol_closes = 0;   // sessions that the server ended
  std::uint64_t reconnects = 0;        // connections after the first of a client
  std::uint64_t repeated_updates = 0;  // received by clients that had them
  std::uint64_t repeated_bytes = 0;    // of messages with nothing new: descriptions after the first of a client
  std::uint64_t resume_bytes = 0;      // of the Have messages that were sent
  std::vector<double> first_mesh_ms;
  std::vector<double> first_mesh_bytes;
  std::vector<double> view_change_ms;  // to the first Batch or Done for a view, or for a newer one
  std::vector<double> view_done_ms;    // to the Done
  std::vector<double> view_bytes;      // of each view that was answered: of its batches
  std::vector<double> stale_bytes;     // of each view: what came of older ones before it was served
  std::vector<double> set_range_ms;    // that a client took to change the range of its mesh
  // Of each reconnect: from when the loss of the server was noticed to the first Batch or Done after it.
  std::vector<double> resume_ms;
  std::map<std::string, std::uint64_t> errors;

  void add(LoadStats&& other);
};

struct LoadReport {
  LoadStats stats;
  std::string scenario;
  std::uint64_t clients = 0;
  double seconds = 0;        // from the start to the end of the duration, or until the last client had everything
  double own_cpu_share = 0;  // processor time of the harness, as a share of all cores
  // The processor time of the busiest thread as a share of the time. Near 1, the harness is the bottleneck.
  double busiest_thread = 0;
  unsigned threads = 0;
  std::optional<std::uint64_t> verified;  // meshes compared; nothing if they were not to be
  std::uint64_t differing = 0;            // of those, the ones that differ
};

// One flat object. Percentiles of nothing are null.
[[nodiscard]] nlohmann::ordered_json to_json(const LoadReport& report);
[[nodiscard]] std::string to_text(const LoadReport& report);

}  // namespace intervale
