// What a server counts and measures, for Prometheus. Any thread.
#pragma once

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/serve/catalogue.h"

namespace intervale {

// Why somebody was turned away: too many connections, or from one address, too many sessions, too much memory; a page's origin; no token that opens
// what is asked for.
enum class Refusal { connections, address, sessions, memory, origin, token };

class Metrics {
  // Before the references below, which are made of it.
  prometheus::Registry registry_;
  prometheus::Family<prometheus::Counter>& closes_;
  prometheus::Family<prometheus::Counter>& refusals_;

 public:
  using Duration = std::chrono::steady_clock::duration;

  Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  prometheus::Gauge& connections;
  prometheus::Gauge& sessions;  // WebSocket sessions
  prometheus::Counter& sessions_total;
  prometheus::Counter& updates_sent_total;
  prometheus::Counter& bytes_sent_total;  // of WebSocket messages
  prometheus::Counter& faults_total;      // sessions ended for what the client did

  void observe_selection(Duration time) { observe(selection_, time); }      // choosing and packing one message
  void observe_first_mesh(Duration time) { observe(first_mesh_, time); }    // from a session's first View to its first message, sent
  void observe_view_change(Duration time) { observe(view_change_, time); }  // the same of a later View
  void count_refusal(Refusal reason);
  void count_close(unsigned code);  // a session has ended so; 0: its connection broke

  // What others know, as of now.
  struct Now {
    const Catalogue& catalogue;
    std::uint64_t queued_bytes = 0;  // of WebSocket messages that are leaving
    std::optional<std::chrono::system_clock::time_point> certificate_expires = {};
  };
  // In Prometheus' text format, version 0.0.4.
  [[nodiscard]] std::string text(const Now& now) const;

 private:
  static void observe(prometheus::Histogram& histogram, Duration time) { histogram.Observe(std::chrono::duration<double>(time).count()); }

  prometheus::Histogram& selection_;
  prometheus::Histogram& first_mesh_;
  prometheus::Histogram& view_change_;
};

}  // namespace intervale
