#include "server/serve/metrics.h"

namespace intervale {
namespace {

void add(std::string& text, const char* name, const char* type, const char* help, const std::atomic<std::uint64_t>& value) {
  text.append("# HELP ").append(name).append(" ").append(help).append("\n# TYPE ").append(name).append(" ").append(type).append("\n");
  text.append(name).append(" ").append(std::to_string(value.load(std::memory_order_relaxed))).append("\n");
}

}  // namespace

std::string Metrics::text() const {
  std::string text;
  add(text, "intervale_connections", "gauge", "Open connections.", connections);
  add(text, "intervale_sessions", "gauge", "Open streaming sessions.", sessions);
  add(text, "intervale_sessions_total", "counter", "Streaming sessions so far.", sessions_total);
  add(text, "intervale_connections_refused_total", "counter", "Connections turned away at the limit.", refused_total);
  add(text, "intervale_updates_sent_total", "counter", "Updates sent.", updates_sent_total);
  add(text, "intervale_bytes_sent_total", "counter", "Bytes of streaming messages sent.", bytes_sent_total);
  add(text, "intervale_session_faults_total", "counter", "Sessions closed for what their client did.", faults_total);
  return text;
}

}  // namespace intervale
