// What a load run measures, and how it is said.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace intervale {

// Percentiles by nearest rank: the smallest sample that at least so many percent of all samples do not pass.
struct Percentiles {
  double p50 = 0, p95 = 0, p99 = 0, max = 0;
};
[[nodiscard]] std::optional<Percentiles> percentiles_of(std::vector<double> samples);  // nothing for no samples; O(samples)

// Of one client, of one thread's clients, or of a whole run. Every sample is kept, 8 bytes each: a client that turns five times a second takes
// 0.3 MB an hour.
struct LoadStats {
  std::uint64_t connected = 0;         // clients whose WebSocket was opened
  std::uint64_t failed = 0;            // clients that did not keep going to the end
  std::uint64_t updates = 0;           // received within the duration, by all clients
  std::uint64_t bytes = 0;             // of messages, likewise, without WebSocket's framing
  std::uint64_t views = 0;             // sent or, where the next one was due already, replaced before they could be
  std::uint64_t late_views = 0;        // more than kLate behind their time when they were sent: the harness or the line is too slow
  std::uint64_t unanswered_views = 0;  // at the end; view_change_ms has them with the time that they waited
  std::uint64_t done_views = 0;        // Done messages
  std::uint64_t complete = 0;          // clients that the whole of their last view had come to
  std::uint64_t protocol_closes = 0;   // sessions that the server ended
  std::uint64_t reconnects = 0;        // sessions after a client's first, that were opened
  std::uint64_t repeated_updates = 0;  // that came to a client that had them
  std::uint64_t repeated_bytes = 0;    // of messages that said nothing new, such as each session's description after the first
  std::uint64_t resume_bytes = 0;      // of messages sent to say what clients have
  std::vector<double> first_mesh_ms;
  std::vector<double> first_mesh_bytes;
  std::vector<double> view_change_ms;
  std::vector<double> stale_bytes;  // of each view: what came of older ones before it was served
  std::vector<double> resume_ms;    // of each reconnect: from when the server was seen to be lost to the first batch or end of a view
  std::map<std::string, std::uint64_t> errors;

  void add(LoadStats&& other);
};

struct LoadReport {
  LoadStats stats;
  std::string scenario;
  std::uint64_t clients = 0;
  double seconds = 0;         // from the start until the duration was over or the last client had all it wanted
  double own_cpu_share = 0;   // of all cores' time
  double busiest_thread = 0;  // of the time, how much the busiest thread had something to do: near 1, the harness is what is slow
  unsigned threads = 0;
  std::optional<std::uint64_t> verified;  // meshes compared; nothing if they were not to be
  std::uint64_t differing = 0;            // of those, the ones that differ
};

// One flat object. Percentiles of nothing are null.
[[nodiscard]] nlohmann::ordered_json to_json(const LoadReport& report);
[[nodiscard]] std::string to_text(const LoadReport& report);

}  // namespace intervale
