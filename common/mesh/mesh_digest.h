// A digest of a mesh, to compare meshes that were made in different places.
#pragma once

#include <string>

#include "common/mesh/mesh.h"
#include "common/util/export.h"

namespace intervale {

// 32 hexadecimal digits. Equal for meshes of the same tetrahedra, by position and Surface, in any order of points and
// tetrahedra. Other meshes have another digest, except by collision; not cryptographic. O(tetrahedra).
[[nodiscard]] INTERVALE_EXPORT std::string mesh_digest(const Mesh& mesh);

}  // namespace intervale
