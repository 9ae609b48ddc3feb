// What a server counts. Any thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

namespace intervale {

struct Metrics {
  std::atomic<std::uint64_t> connections{0};  // now
  std::atomic<std::uint64_t> sessions{0};     // WebSocket sessions now
  std::atomic<std::uint64_t> sessions_total{0};
  std::atomic<std::uint64_t> refused_total{0};  // connections over the limit
  std::atomic<std::uint64_t> updates_sent_total{0};
  std::atomic<std::uint64_t> bytes_sent_total{0};  // of WebSocket messages
  std::atomic<std::uint64_t> faults_total{0};      // sessions ended for what the client did

  // In Prometheus' text format, version 0.0.4.
  [[nodiscard]] std::string text() const;
};

}  // namespace intervale
