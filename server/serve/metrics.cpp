#include "server/serve/metrics.h"

#include <prometheus/text_serializer.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "server/scratch/scratch_memory.h"

namespace intervale {
namespace {

using prometheus::Histogram;
using prometheus::MetricFamily;
using prometheus::MetricType;
using prometheus::Registry;

// The codes with a series of their own. A client may send any code, and must not create series without limit.
constexpr std::array<unsigned, 14> kCodes{1000, 1001, 1002, 1003, 1005, 1011, 4400, 4401, 4403, 4404, 4408, 4409, 4413, 4426};

// In the order of Memory::kHolders.
constexpr std::array<const char*, Memory::kHolders.size()> kHolders{"datasets", "sessions", "queues", "ranges"};

// In Refusal's order.
constexpr std::array<const char*, 6> kReasons{"connections", "address", "sessions", "memory", "origin", "token"};

const Histogram::BucketBoundaries kSelectionSeconds{0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1};
const Histogram::BucketBoundaries kAnswerSeconds{0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10};

prometheus::Gauge& gauge(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
}

prometheus::Counter& counter(Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
}

Histogram& histogram(Registry& registry, const char* name, const char* help, const Histogram::BucketBoundaries& buckets) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry).Add({}, buckets);
}

prometheus::ClientMetric value(double number, std::vector<prometheus::ClientMetric::Label> labels = {}) {
  prometheus::ClientMetric metric;
  metric.label = std::move(labels);
  metric.gauge.value = number;
  return metric;
}

MetricFamily gauges(const char* name, const char* help, std::vector<prometheus::ClientMetric> metrics) {
  return {name, help, MetricType::Gauge, std::move(metrics)};
}

prometheus::ClientMetric count(double number, std::vector<prometheus::ClientMetric::Label> labels = {}) {
  prometheus::ClientMetric metric;
  metric.label = std::move(labels);
  metric.counter.value = number;
  return metric;
}

prometheus::ClientMetric cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) { return double(time.tv_sec) + 1e-6 * double(time.tv_usec); };
  return count(seconds(usage.ru_utime) + seconds(usage.ru_stime));
}

// What --data-memory does.
void add_data_memory(const ScratchMemory& data, const PageKeeper& keeper, std::vector<MetricFamily>& families) {
  constexpr double kBlock = 512;  // bytes; of ru_inblock
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  families.push_back(
      gauges("intervale_data_memory_limit_bytes", "Resident memory of data sets that --data-memory allows.", {value(double(data.budget()))}));
  families.push_back(gauges("intervale_data_resident_bytes", "Resident memory of data sets.", {value(double(keeper.resident()))}));
  families.push_back(gauges("intervale_data_scratch_bytes", "Data sets in the scratch file.", {value(double(data.array_bytes()))}));
  families.push_back({"intervale_data_evicted_bytes_total",
                      "Pages of data sets that were taken out of memory.",
                      MetricType::Counter,
                      {count(double(keeper.taken_out()))}});
  families.push_back({"intervale_page_faults_total",
                      "Page faults of the process: major ones waited for a disk, minor ones did not.",
                      MetricType::Counter,
                      {count(double(usage.ru_majflt), {{"kind", "major"}}), count(double(usage.ru_minflt), {{"kind", "minor"}})}});
  families.push_back({"intervale_disk_read_bytes_total",
                      "Bytes that the process had read from disks, page faults included.",
                      MetricType::Counter,
                      {count(kBlock * double(usage.ru_inblock))}});
}

}  // namespace

Metrics::Metrics()
    : closes_(prometheus::BuildCounter()
                  .Name("intervale_session_closes_total")
                  .Help("Sessions that ended, by close code; none: the connection broke.")
                  .Register(registry_)),
      refusals_(prometheus::BuildCounter().Name("intervale_refused_total").Help("Connections and sessions refused, by reason.").Register(registry_)),
      connections(gauge(registry_, "intervale_connections", "Open connections.")),
      sessions(gauge(registry_, "intervale_sessions", "Open streaming sessions.")),
      sessions_total(counter(registry_, "intervale_sessions_total", "Streaming sessions so far.")),
      updates_sent_total(counter(registry_, "intervale_updates_sent_total", "Updates sent.")),
      bytes_sent_total(counter(registry_, "intervale_bytes_sent_total", "Bytes of streaming messages sent.")),
      faults_total(counter(registry_, "intervale_session_faults_total", "Sessions closed because of a fault of the client.")),
      selection_(histogram(registry_, "intervale_selection_seconds", "Processor time to select and encode one message.", kSelectionSeconds)),
      first_mesh_(histogram(registry_, "intervale_first_mesh_seconds", "From a session's first view until the first message for it is sent.",
                            kAnswerSeconds)),
      view_change_(
          histogram(registry_, "intervale_view_change_seconds", "From a later view until the first message for it is sent.", kAnswerSeconds)) {
  // All series exist from the start, so that rates begin at 0.
  for (const unsigned code : kCodes) closes_.Add({{"code", std::to_string(code)}});
  for (const char* reason : kReasons) refusals_.Add({{"reason", reason}});
}

void Metrics::count_refusal(Refusal reason) { refusals_.Add({{"reason", kReasons[std::size_t(reason)]}}).Increment(); }

void Metrics::count_close(unsigned code) {
  const bool known = std::find(kCodes.begin(), kCodes.end(), code) != kCodes.end();
  closes_.Add({{"code", code == 0 ? "none" : known ? std::to_string(code) : "other"}}).Increment();
}

std::string Metrics::text(const Gauges& now) const {
  std::vector<MetricFamily> families = registry_.Collect();
  std::vector<prometheus::ClientMetric> memory;
  std::uint64_t lost = 0;
  for (const auto& [name, volume] : now.catalogue.volumes()) {
    memory.push_back(value(double(volume->memory_bytes()), {{"dataset", name}}));
    lost += volume->lost_updates();
  }
  std::vector<prometheus::ClientMetric> held;
  held.reserve(Memory::kHolders.size());
  for (const Memory::Holder holder : Memory::kHolders)
    held.push_back(value(double(now.memory.bytes(holder)), {{"holder", kHolders[std::size_t(holder)]}}));
  families.push_back(gauges("intervale_memory_bytes", "Memory that the server counts, by holder; --max-memory limits the sum.", std::move(held)));
  families.push_back(gauges("intervale_uncounted_memory_bytes", "Resident memory that is not counted: the program, work under way, the allocator's.",
                            {value(double(uncounted_bytes(now.memory)))}));
  families.push_back(gauges("intervale_queued_bytes", "Unsent bytes of streaming messages.", {value(double(now.queued_bytes))}));
  families.push_back(gauges("intervale_datasets", "Data sets served.", {value(double(now.catalogue.volumes().size()))}));
  families.push_back(gauges("intervale_lost_updates", "Updates that damaged files have lost, of the data sets served: see --tolerate-damage.",
                            {value(double(lost))}));
  families.push_back(gauges("intervale_dataset_memory_bytes", "Memory of a data set.", std::move(memory)));
  if (const ScratchMemory* const data = now.memory.data_memory(); data != nullptr && data->keeper() != nullptr)
    add_data_memory(*data, *data->keeper(), families);
  if (now.certificate_expires) {
    const std::chrono::duration<double> time = now.certificate_expires->time_since_epoch();
    families.push_back(
        gauges("intervale_certificate_expiry_timestamp_seconds", "When the certificate expires, in Unix time.", {value(time.count())}));
  }
  families.push_back(gauges("intervale_resident_memory_bytes", "Resident memory of the process.", {value(double(resident_bytes()))}));
  families.push_back({"intervale_cpu_seconds_total", "Processor time of the process.", MetricType::Counter, {cpu_seconds()}});
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace intervale
