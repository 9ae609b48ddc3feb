// Mesh files: .vtu holds the tetrahedra; .vtp, .ply, .stl, .obj and .glb hold the boundary's triangles, oriented outward.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/mesh.h"
#include "common/result.h"

namespace intervale {

// The triangles that lie in one tetrahedron only, seen from outside counterclockwise, as indices into mesh.points.
// O(tetrahedra); order: by first appearance.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> boundary_triangles(const Mesh& mesh);

// Whether a mesh can be written to this path, by its extension; misuse with the list of extensions otherwise. Call before long work.
Result<void> check_mesh_path(const std::filesystem::path& path);

// Writes a mesh by the extension of path, aside and renamed. An empty mesh is a valid empty file.
Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh);

// The sum of the volumes of the tetrahedra, world units cubed; compensated, so that it does not depend on their order to 1e-12 relative.
[[nodiscard]] double volume_of(const Mesh& mesh);

}  // namespace intervale
