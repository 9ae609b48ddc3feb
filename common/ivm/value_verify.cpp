#include "common/ivm/value_verify.h"

#include <optional>
#include <string>
#include <vector>

#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/page_bounds.h"
#include "common/ivm/value_page.h"

namespace intervale {

namespace {

Result<void> check_bounds(const ValueVolume& volume, const ParallelFor& parallel) {
  const std::vector<PageBounds>& stored = volume.parts().page_bounds;
  if (stored.empty()) return {};
  const std::vector<PageBounds> found = bounds_of_pages(volume.parts(), pages_of(volume.set()), parallel);
  for (std::size_t page = 0; page < found.size(); ++page) {
    if (stored[page].least > found[page].least || stored[page].greatest < found[page].greatest)
      return fail("values around page " + std::to_string(page) + " of " + std::to_string(found.size()) + " are outside of its bounds");
  }
  return {};
}

}  // namespace

Result<void> validate(const ValueVolume& volume, const ParallelFor& parallel) {
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
  return check_bounds(volume, parallel);
}

}  // namespace intervale
