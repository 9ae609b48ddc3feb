#include "server/serve/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "server/scratch/scratch_memory.h"

namespace intervale {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

TEST(Metrics, ReportWhatWasCounted) {
  Metrics metrics;
  Memory memory;
  const Memory::Share held(memory, Memory::Holder::sessions, 4096);
  metrics.sessions.Increment();
  metrics.sessions.Increment();
  metrics.sessions.Decrement();
  metrics.updates_sent_total.Increment(1e9);
  metrics.observe_selection(2ms);
  metrics.observe_selection(20s);
  metrics.observe_first_mesh(30ms);
  metrics.observe_view_change(30ms);
  const std::string text = metrics.text({.catalogue = {}, .memory = memory, .queued_bytes = 100});
  for (const char* line :
       {"# TYPE intervale_sessions gauge", "intervale_sessions 1", "intervale_updates_sent_total 1000000000", "intervale_queued_bytes 100",
        "# TYPE intervale_selection_seconds histogram", "intervale_selection_seconds_bucket{le=\"0.0025\"} 1",
        "intervale_selection_seconds_bucket{le=\"+Inf\"} 2", "intervale_selection_seconds_count 2",
        "intervale_first_mesh_seconds_bucket{le=\"0.05\"} 1", "intervale_view_change_seconds_sum 0.03", "intervale_datasets 0",
        "intervale_memory_bytes{holder=\"sessions\"} 4096", "intervale_memory_bytes{holder=\"ranges\"} 0"}) {
    EXPECT_THAT(text, HasSubstr(std::string(line) + "\n"));
  }
  EXPECT_THAT(text, HasSubstr("intervale_resident_memory_bytes "));
  EXPECT_THAT(text, Not(HasSubstr("intervale_resident_memory_bytes 0\n")));
  EXPECT_THAT(text, HasSubstr("intervale_uncounted_memory_bytes "));
  EXPECT_THAT(text, HasSubstr("# TYPE intervale_cpu_seconds_total counter\nintervale_cpu_seconds_total "));
}

TEST(Metrics, TellOfDataMemoryOnlyWhereThereIsSome) {
  Memory plain;
  EXPECT_THAT(Metrics().text({.catalogue = {}, .memory = plain}), AllOf(Not(HasSubstr("intervale_data_")), Not(HasSubstr("page_faults"))));
  const auto data = ScratchMemory::open_for_data_sets("/var/tmp", 10'000'000);
  ASSERT_TRUE(data) << data.error().message;
  void* const array = (*data)->allocate(1 << 20);
  Memory memory({}, data->get());
  const std::string text = Metrics().text({.catalogue = {}, .memory = memory});
  for (const char* line :
       {"intervale_data_memory_limit_bytes 10000000", "intervale_data_scratch_bytes 1048576", "# TYPE intervale_data_resident_bytes gauge",
        "intervale_data_evicted_bytes_total 0", "# TYPE intervale_page_faults_total counter", "# TYPE intervale_disk_read_bytes_total counter"}) {
    EXPECT_THAT(text, HasSubstr(std::string(line) + "\n"));
  }
  for (const char* kind : {"major", "minor"}) EXPECT_THAT(text, HasSubstr(std::string("intervale_page_faults_total{kind=\"") + kind + "\"} "));
  (*data)->free(array);
}

// A client chooses the code it closes with, and may not make the list of series grow.
TEST(Metrics, HaveNoSeriesForUnknownCloseCodes) {
  Metrics metrics;
  Memory memory;
  EXPECT_THAT(metrics.text({.catalogue = {}, .memory = memory}), HasSubstr("intervale_session_closes_total{code=\"4404\"} 0\n"));
  const auto lines = [&] {
    const std::string text = metrics.text({.catalogue = {}, .memory = memory});
    return std::count(text.begin(), text.end(), '\n');
  };
  metrics.count_close(3000);
  metrics.count_close(0);
  const auto before = lines();
  for (unsigned code = 0; code <= 5000; ++code) metrics.count_close(code);
  EXPECT_EQ(lines(), before);
  EXPECT_THAT(metrics.text({.catalogue = {}, .memory = memory}), HasSubstr("{code=\"1000\"} 1\n"));
  EXPECT_THAT(metrics.text({.catalogue = {}, .memory = memory}), HasSubstr("{code=\"none\"} 2\n"));
}

}  // namespace
}  // namespace intervale
