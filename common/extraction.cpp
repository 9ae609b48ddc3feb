#include "common/extraction.h"

#include <utility>

#include "common/update.h"

namespace intervale {
namespace {

constexpr std::uint64_t kProgressEvery = 1 << 15;

tl::unexpected<Error> misfit(Vertex c) {
  return fail("the interval volume is damaged: the update at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) +
              ") does not fit the ones before it");
}

}  // namespace

Result<Extraction> extract(const Grid& grid, const Base& base, const SupercubeSet& set, const SplitSet& split,
                           const std::function<bool(Front&, Front::Handle, const Place&)>& apply, const OnProgress& progress) {
  Extraction result{Front(grid, base)};
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

Result<Extraction> extract(const IntervalVolume& volume, const Lod& lod, const OnProgress& progress) {
  if (auto ok = check_lod(lod); !ok) return tl::unexpected(ok.error());
  const auto base = decode_base(volume.description().base, volume.domain());
  if (!base) return tl::unexpected(base.error());
  const SplitSet chosen = select(volume, lod);
  if (!lod.max_tets && !lod.max_updates) {
    return extract(
        volume.description().grid, *base, volume.set(), chosen,
        [&volume](Front& front, Front::Handle handle, const Place& p) { return apply_update(front, handle, volume.update(p)).has_value(); },
        progress);
  }
  Extraction result{Front(volume.description().grid, *base)};
  const std::vector<UpdateIndex> order = in_order(volume, chosen);
  for (UpdateIndex i : order) {
    if (lod.max_updates && result.updates == *lod.max_updates) break;
    const Place p = volume.set().place(i);
    const Vertex c = volume.set().centre(p);
    const auto handle = result.front.find(c);
    if (!handle) return misfit(c);
    const auto spine = apply_update(result.front, *handle, volume.update(p));
    if (!spine) return misfit(c);
    if (lod.max_tets && result.front.tet_count() > *lod.max_tets) {
      result.front.merge(c, *spine);
      break;
    }
    ++result.updates;
    if (progress && result.updates % kProgressEvery == 0) progress(double(result.updates) / double(order.size()));
  }
  return result;
}

}  // namespace intervale
