// A mesh in one short text, by which two that were made in different places are compared.
#pragma once

#include <string>

#include "common/mesh/mesh.h"

namespace intervale {

// 32 hexadecimal digits. Equal for meshes of the same tetrahedra at the same places with the same surfaces, in any order of points and tetrahedra;
// for others it differs, but by an accident that none need fear who does not look for it. O(tetrahedra).
[[nodiscard]] std::string mesh_digest(const Mesh& mesh);

}  // namespace intervale
