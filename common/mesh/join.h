// Several meshes as one.
#pragma once

#include <vector>

#include "common/mesh/mesh.h"
#include "common/util/export.h"

namespace intervale {

// The meshes of several ranges as one: points and tetrahedra of the first, then of the second, and so on. With more than
// one, Mesh::part says of each tetrahedron which it is from; they share no points. Either all have values or none.
[[nodiscard]] INTERVALE_EXPORT Mesh joined(std::vector<Mesh> parts);

}  // namespace intervale
