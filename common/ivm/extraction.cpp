#include "common/ivm/extraction.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "common/util/bits.h"

namespace intervale {
namespace {

tl::unexpected<Error> misfit(Vertex c) {
  return fail("the interval volume is damaged: the update at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) +
              ") does not fit the ones before it");
}

// Splits these diamonds of all fronts. Returns the centre of one that cannot be split.
std::optional<Vertex> split_all(std::vector<Front>& fronts, const IntervalVolume& volume, const std::vector<SlotGroup>& groups,
                                const ParallelFor& parallel) {
  const SupercubeSet& set = volume.set();
  const auto keys_of = [&](const SlotGroup& g, std::span<ValueKey, kSlots> keys) {
    UpdateIndex i = set.first(g.brick, g.supercube);
    for (const Slot slot : set_bits<Slot>(set.occupancy()[g.supercube])) keys[slot] = volume.key(i++);
  };
  for (Front& front : fronts) {
    if (const auto wrong = front.split_all(groups, keys_of, parallel)) return wrong;
  }
  return {};
}

// The same in this order, until a budget is used up.
std::optional<Vertex> split_within(std::vector<Front>& fronts, const IntervalVolume& volume, const std::vector<UpdateIndex>& updates,
                                   const Lod& lod) {
  std::uint64_t withheld = 0;
  for (const UpdateIndex i : updates) {
    if (withheld > 0 || (lod.max_updates && fronts.front().split_count() == *lod.max_updates)) break;
    const Place p = volume.set().place(i);
    for (std::size_t f = 0; f < fronts.size(); ++f) {
      FrontCursor cursor(fronts[f].state());
      cursor.move_to(p.key);
      if (!cursor.find(p.slot)) return SupercubeSet::centre(p);
      fronts[f].split(cursor, volume.key(i), lod.max_tets ? tets_left(fronts, f, *lod.max_tets) : UINT64_MAX);
      withheld += fronts[f].withheld_count();
    }
  }
  return {};
}

}  // namespace

Front root_front(const Description& d, const ShownRange& shown) { return {d.grid, d.format, d.corners, shown.range, shown.refine}; }

Result<std::vector<Extraction>> extract(const IntervalVolume& volume, const RelevantUpdates& relevant, const ShownRanges& shown, const Lod& lod,
                                        const ParallelFor& parallel) {
  if (auto ok = check_lod(lod); !ok) return tl::unexpected(ok.error());
  const SplitSet chosen = select(volume, relevant, lod);
  std::vector<Front> fronts;
  fronts.reserve(shown.size());
  for (const ShownRange& one : shown) fronts.push_back(root_front(volume.description(), one));
  const bool is_limited = lod.max_tets || lod.max_updates;
  const auto wrong = is_limited ? split_within(fronts, volume, in_order(volume, relevant, chosen, lod), lod)
                                : split_all(fronts, volume, chosen.groups(volume.set()), parallel);
  if (wrong) return misfit(*wrong);
  std::vector<Extraction> each;
  each.reserve(fronts.size());
  for (Front& front : fronts) {
    if (front.state().points > kMostPoints) return fail("the mesh has more than 2^32 - 1 vertices: choose a larger error or a smaller region");
    const std::uint64_t updates = front.shown_count();
    each.push_back({std::move(front), updates});
  }
  return each;
}

std::vector<MeshChannel> channels_of(const IntervalVolume& volume, std::span<const std::size_t> numbers) {
  std::vector<MeshChannel> channels;
  channels.reserve(numbers.size());
  for (const std::size_t number : numbers) {
    const Channel& channel = volume.description().channels[number];
    const ChannelKeys& keys = volume.channel_keys()[number];
    const auto values_at = [&volume, &channel, &keys](Vertex vertex, std::span<double> values) {
      const int corner = volume.domain().corner_number(vertex);
      const auto place = corner < 0 ? volume.set().find(vertex) : std::nullopt;
      for (std::size_t c = 0; c < values.size(); ++c) {
        const ChannelComponent& component = channel.components[c];
        values[c] = component.format.value(corner < 0 ? keys[c][place->index] : component.corners[std::size_t(corner)]);
      }
    };
    channels.push_back({channel.name, channel.unit, unsigned(channel.components.size()), values_at});
  }
  return channels;
}

Result<Extraction> extract(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod, const ParallelFor& parallel) {
  auto each = extract(volume, relevant, relevant.shown(), lod, parallel);
  if (!each) return tl::unexpected(each.error());
  return std::move(each->front());
}

}  // namespace intervale
