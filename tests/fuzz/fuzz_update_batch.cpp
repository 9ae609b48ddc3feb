// Bytes as a batch of updates. The first byte picks the volume, the second how far its client has come and whether
// there is a budget; the rest is the batch.
#include <cstdio>
#include <cstdlib>

#include "common/ivm/extraction.h"
#include "common/ivm/refinement.h"
#include "tests/fuzz/small_volumes.h"
#include "tests/support/batches.h"

using namespace intervale;

namespace {

constexpr std::size_t kStages = 8;

// For each volume its client at stages from 0 to all but the last updates.
const std::vector<std::vector<Front>>& clients() {
  static const std::vector<std::vector<Front>> all = [] {
    std::vector<std::vector<Front>> made;
    for (const IntervalVolume& v : testing::small_volumes()) {
      const auto queue = in_order(v, select(v, {}), {});
      auto& stages = made.emplace_back();
      for (std::size_t stage = 0; stage < kStages; ++stage) {
        Front& front = stages.emplace_back(root_front(v.description()));
        if (!testing::apply_to(front, v.description(), testing::batch_of(v, std::span(queue).first(queue.size() * stage / kStages)))) std::abort();
      }
    }
    return made;
  }();
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t volume = data[0] % clients().size();
  Front front = clients()[volume][data[1] % kStages];
  std::uint64_t max_tets = ~std::uint64_t(0);
  if (data[1] & 0x80) max_tets = front.tet_count() + (data[1] >> 3 & 15);
  const Description& description = testing::small_volumes()[volume].description();
  const auto applied = testing::apply_to(front, description, {data + 2, size - 2}, max_tets);
  if (!applied) {
    if (applied.error().message.empty()) std::abort();
    return 0;
  }
  const auto broken = front.validate();
  if (broken) std::fprintf(stderr, "the front does not hold: %s\n", broken->c_str());
  if (broken || front.tet_count() > max_tets) std::abort();
  if (front.mesh().tets.size() != front.tet_count()) std::abort();
  return 0;
}
