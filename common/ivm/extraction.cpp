#include "common/ivm/extraction.h"

#include <utility>

#include "common/codec/update.h"
#include "common/front/split_update.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr std::uint64_t kProgressEvery = 1 << 15;

tl::unexpected<Error> misfit(Vertex c) {
  return fail("the interval volume is damaged: the update at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) +
              ") does not fit the ones before it");
}

}  // namespace

Result<Extraction> extract(const Grid& grid, const RootPatch& root_patch, const SupercubeSet& set, const SplitSet& split,
                           const std::function<bool(Front&, Front::Handle, const Place&)>& apply, const OnProgress& progress) {
  Extraction result{Front(grid, root_patch)};
  const auto total = double(split.count());
  std::optional<Vertex> wrong;
  set.for_each_down([&](const Place& p) {
    if (wrong || !split.contains(p.index)) return;
    const Vertex c = set.centre(p);
    const auto handle = result.front.find(c);
    if (!handle || !apply(result.front, *handle, p)) {
      wrong = c;
      return;
    }
    ++result.updates;
    if (progress && result.updates % kProgressEvery == 0) progress(double(result.updates) / total);
  });
  if (wrong) return misfit(*wrong);
  return result;
}

Result<Extraction> extract(const IntervalVolume& volume, const Lod& lod, const OnProgress& progress, const ParallelFor& parallel) {
  if (auto ok = check_lod(lod); !ok) return tl::unexpected(ok.error());
  const auto root_patch = decode_root_patch(volume.description().root_patch, volume.domain());
  if (!root_patch) return tl::unexpected(root_patch.error());
  const SplitSet chosen = select(volume, lod);
  Extraction result{Front(volume.description().grid, *root_patch)};
  Front& front = result.front;
  if (!lod.max_tets && !lod.max_updates) {
    const auto updates_of = [&volume](const SlotGroup& g, std::span<UpdateView, kSlots> updates) {
      UpdateIndex i = volume.set().first(g.brick, g.supercube);
      std::uint32_t residual = volume.first_residual(g.brick, g.supercube);
      for (const Slot slot : set_bits<Slot>(volume.set().occupancy()[g.supercube])) {
        updates[std::size_t(slot)] = volume.update(i++, residual);
        residual += std::uint32_t(updates[std::size_t(slot)].residuals.size());
      }
    };
    const auto wrong = front.split_all(chosen.groups(volume.set()), updates_of, parallel, progress);
    if (wrong) return misfit(*wrong);
    result.updates = front.split_count();
    return result;
  }
  const std::vector<UpdateIndex> order = in_order(volume, chosen, lod);
  for (UpdateIndex i : order) {
    if (lod.max_updates && result.updates == *lod.max_updates) break;
    const Place p = volume.set().place(i);
    const Vertex c = volume.set().centre(p);
    const auto handle = front.find(c);
    if (!handle || !apply_update(front, *handle, volume.update(p))) return misfit(c);
    if (lod.max_tets && front.tet_count() > *lod.max_tets) {
      front.merge(c);
      break;
    }
    ++result.updates;
    if (progress && result.updates % kProgressEvery == 0) progress(double(result.updates) / double(order.size()));
  }
  return result;
}

}  // namespace intervale
