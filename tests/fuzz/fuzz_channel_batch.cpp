// Bytes as the values of channels in a batch without updates. The first byte picks how far the client has come; the rest is
// the batch.
#include <cstdlib>

#include "common/front/channel_values.h"
#include "common/ivm/extraction.h"
#include "common/ivm/refinement.h"
#include "tests/fuzz/small_volumes.h"
#include "tests/support/batches.h"

using namespace intervale;

namespace {

constexpr std::size_t kStages = 8;

const IntervalVolume& volume() { return testing::small_volumes()[1]; }

// Fronts from the root to all updates.
const std::vector<Front>& stages() {
  static const std::vector<Front> all = [] {
    std::vector<Front> made;
    const auto queue = in_order(volume(), select(volume(), {}), {});
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      Front& front = made.emplace_back(root_front(volume().description()));
      const auto some = std::span(queue).first(queue.size() * stage / (kStages - 1));
      if (!testing::apply_to(front, volume().description(), testing::batch_of(volume(), some))) std::abort();
    }
    return made;
  }();
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const Front& front = stages()[data[0] % kStages];
  std::vector<ChannelValues> channels;
  for (const Channel& channel : volume().description().channels) channels.emplace_back(volume().description().grid, channel);
  const std::vector<ChannelValues*> both{&channels[0], &channels[1]};
  const auto applied = apply_channels(both, front, {}, {data + 1, size - 1});
  if (!applied && applied.error().message.empty()) std::abort();
  if (!applied) return 0;
  const std::vector<MeshChannel> shown{channels[0].for_mesh(), channels[1].for_mesh()};
  const Mesh mesh = front.mesh(serial, shown);
  if (mesh.channels[0].value.size() != mesh.points.size() || mesh.channels[1].value.size() != 3 * mesh.points.size()) std::abort();
  channels[0].keep_split(stages()[0], channels[0].groups());
  if (!channels[0].groups().empty()) std::abort();
  return 0;
}
