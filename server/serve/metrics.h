// The server's metrics, for Prometheus. Any thread.
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
#include "server/serve/memory.h"

namespace intervale {

// Why a connection or session was refused: a limit (connections in all or by address, sessions, memory), the origin
// of a page, no valid token. The label of intervale_refused_total.
enum class Refusal { connections, address, sessions, memory, origin, token };

class Metrics {
  // First: the references below are initialised from it.
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
  prometheus::Counter& faults_total;      // sessions that were closed because of a client's fault

  void observe_selection(Duration time) { observe(selection_, time); }  // of one message: selecting and encoding
  // From the first View until a message is sent.
  void observe_first_mesh(Duration time) { observe(first_mesh_, time); }
  void observe_view_change(Duration time) { observe(view_change_, time); }  // the same for later Views
  void count_refusal(Refusal reason);
  void count_close(unsigned code);  // a session's close code; 0: its connection broke

  // Values that are not counted here.
  struct Gauges {
    const Catalogue& catalogue;
    const Memory& memory;
    std::uint64_t queued_bytes = 0;  // unsent, see WriteBudget
    std::optional<std::chrono::system_clock::time_point> certificate_expires = {};
  };
  // In Prometheus' text format, version 0.0.4.
  [[nodiscard]] std::string text(const Gauges& gauges) const;

 private:
  static void observe(prometheus::Histogram& histogram, Duration time) { histogram.Observe(std::chrono::duration<double>(time).count()); }

  prometheus::Histogram& selection_;
  prometheus::Histogram& first_mesh_;
  prometheus::Histogram& view_change_;
};

}  // namespace intervale
