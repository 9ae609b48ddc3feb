#include "common/ivm/verify.h"

#include <optional>
#include <string>

#include "common/ivm/extraction.h"

namespace intervale {
namespace {

std::string where(Vertex c) { return " at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) + ")"; }

}  // namespace

Result<void> validate(const IntervalVolume& volume) {
  const Description& description = volume.description();
  const Domain& domain = volume.domain();
  const SupercubeSet& set = volume.set();
  const auto error_steps = volume.error_steps();
  if (description.max_error != (error_steps.empty() ? 0.0 : double(error_steps.back()))) return fail("the largest error is not that of any update");
  Front front = root_front(description);
  std::optional<Error> wrong;
  set.for_each_down([&](const Place& p) {
    if (wrong) return;
    const Vertex c = set.centre(p);
    const auto handle = front.find(c);
    if (!handle) {
      wrong = Error{"an update has no parent, or lies outside the box" + where(c)};
      return;
    }
    const Diamond d(c);
    for (int k = 0; k < d.row->parents; ++k) {
      const Vertex q = d.parent(k);
      if (domain.clamp(q) != q && domain.tets(Diamond(q)) == 0) continue;
      const auto parent = set.find(q);
      if (parent && volume.error_step(parent->index) < volume.error_step(p.index)) wrong = Error{"an error is greater than its parent's" + where(c)};
    }
    front.split(*handle, volume.key(p.index));
  });
  if (wrong) return tl::unexpected(*wrong);
  if (const auto broken = front.validate()) return fail(*broken);
  if (front.tet_count() != description.full.tets) {
    return fail("the full mesh has " + std::to_string(front.tet_count()) + " tetrahedra, " + std::to_string(description.full.tets) + " expected");
  }
  const Mesh mesh = front.mesh();
  if (mesh.points.size() != description.full.vertices) {
    return fail("the full mesh has " + std::to_string(mesh.points.size()) + " vertices, " + std::to_string(description.full.vertices) + " expected");
  }
  return {};
}

}  // namespace intervale
