#include "common/ivm/every_range.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/block_lattice.h"
#include "common/ivm/saturate.h"
#include "common/util/round_up.h"

namespace intervale {
namespace {

// The lowest level among a diamond's nearest ancestors of scale 1 or coarser, which are all as large as its error. around:
// at its supercube.
ErrorLevel level_of_ancestors(const SupercubeSet& set, const std::vector<ErrorLevel>& levels, std::size_t coarse, SupercubeKey key, Slot slot) {
  SetNeighbours around(set);
  around.move_to(key);
  const Links& links = around.links(slot);
  ErrorLevel lowest = kErrorLevels - 1;
  for (std::size_t k = 0; k < diamond_type(kTypeOfSlot[slot]).parents; ++k) {
    const auto parent = around.at(links.vertex[links.parent[k]]);
    if (!parent.supercube.has(parent.slot)) continue;
    const UpdateIndex i = parent.supercube.index(parent.slot);
    lowest = std::min(lowest, i < coarse ? levels[i] : level_of_ancestors(set, levels, coarse, parent.supercube.key, parent.slot));
  }
  return lowest;
}

// The levels of the diamonds of scale 0: saturated errors at the middles of spines, which are all that is inside. What
// the box cuts has that of its ancestors, for there the samples inside are others. levels: of the coarser ones; it gets
// those of all.
void add_finest_levels(const ValueVolume& volume, std::vector<ErrorLevel>& levels, const ParallelFor& parallel) {
  const ValueVolume::Parts& parts = volume.parts();
  const SupercubeSet& set = parts.set;
  const std::size_t coarse = levels.size();
  levels.resize(set.size());
  std::vector<BrickRun> blocks = blocks_of(set);
  std::erase_if(blocks, [&set](const BrickRun& block) { return scale_of_key(set.bricks()[block.first].key) != 0; });
  parallel(blocks.size(), [&](std::size_t block) {
    BlockLattice lattice(parts);
    lattice.move_to(block_of(set.bricks()[blocks[block].first].key), BlockLattice::Load::all);
    VertexKeys around{};
    for (BrickIndex brick = blocks[block].first; brick < blocks[block].end; ++brick) {
      set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
        const BlockLattice::Point first = lattice.at(key);
        const bool all_interior = is_interior(volume.domain(), 0, position_of_key(key));
        UpdateIndex i = set.first(brick, s);
        for (const Slot slot : set_bits<Slot>(set.occupancy()[s])) {
          if (all_interior || volume.domain().is_interior(Diamond(centre_of(key, slot)))) {
            const BlockLattice::Point centre = first + BlockLattice::of_slot(slot);
            lattice.gather(centre, slot, around);
            const double error = spine_error(parts.description.format, around[0], around[1], lattice.key(centre));
            levels[i] = ValueVolume::level_of_error(parts.description.max_error, error);
          } else {
            levels[i] = level_of_ancestors(set, levels, coarse, key, slot);
          }
          ++i;
        }
      });
    }
  });
  saturate(set, levels, 1, parallel);
}

}  // namespace

Result<IntervalVolume> of_every_range(ValueVolume::Parts values, const ParallelFor& parallel) {
  IntervalVolume::Parts parts;
  std::vector<ErrorLevel> levels = std::move(values.error_levels);
  ValueVolume volume(std::move(values));
  add_finest_levels(volume, levels, parallel);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const FieldDescription& d = volume.description();
  Description& to = parts.description;
  to.name = d.name;
  to.grid = d.grid;
  to.labels = d.labels;
  to.range = {-kInfinity, kInfinity};
  to.refine = Refine::uniform;
  to.has_every_range = true;
  to.format = d.format;
  to.is_exact = d.is_exact;
  to.corners = d.corners;
  to.weights = volume.weights();
  to.max_error = d.max_error;
  to.content_hash = d.content_hash;
  for (int level = 0; level < kErrorLevels; ++level) parts.error_steps.push_back(round_up(volume.error(ErrorLevel(level))));
  parts.steps = std::move(levels);
  parts.surface.to_distance.resize(volume.set().supercubes());
  values = std::move(volume).take();
  parts.statistics = std::make_shared<const FieldStatistics>(std::move(values.description.statistics));
  parts.set = std::move(values.set);
  parts.keys = std::move(values.keys);
  parts.left = std::move(values.left);
  parts.finer = values.finer;
  auto made = IntervalVolume::assemble(std::move(parts), parallel);
  if (!made) return made;
  (void)made->bounds(parallel);  // whoever asks for a range first would wait for them
  if (auto ok = made->set_channels(std::move(values.description.channels), std::move(values.channel_keys)); !ok) return tl::unexpected(ok.error());
  return made;
}

}  // namespace intervale
