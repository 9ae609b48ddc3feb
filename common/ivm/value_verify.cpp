#include "common/ivm/value_verify.h"

#include <optional>
#include <string>

#include "common/diamond/supercube_neighbours.h"

namespace intervale {

Result<void> validate(const ValueVolume& volume) {
  const SupercubeSet& set = volume.set();
  const ValueKey last = volume.description().format.last;
  const auto& levels = volume.parts().error_levels;
  SetNeighbours around(set);
  std::optional<Error> wrong;
  for (BrickIndex brick{0}; brick < set.bricks().size() && !wrong; ++brick) {
    set.for_each_in_brick(brick, ~std::uint64_t(0), [&](const Place& p) {
      const Vertex c = SupercubeSet::centre(p);
      const auto where = [&c] { return " at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) + ")"; };
      if (volume.key(p.index) > last) wrong = Error{"a value is out of range" + where()};
      if (p.index >= levels.size()) return;
      around.move_to(p.key);
      const Links& links = around.links(p.slot);
      for (std::size_t k = 0; k < diamond_type(kTypeOfSlot[p.slot]).parents; ++k) {
        const auto parent = around.at(links.vertex[links.parent[k]]);
        if (!parent.supercube.has(parent.slot)) continue;
        if (levels[parent.supercube.index(parent.slot)] < levels[p.index]) wrong = Error{"an error is greater than its parent's" + where()};
      }
    });
  }
  if (wrong) return tl::unexpected(*wrong);
  return {};
}

}  // namespace intervale
