// Mesh files: .vtu holds the tetrahedra; .vtp, .ply, .stl, .obj and .glb hold the boundary's triangles, oriented outward.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/util/result.h"

namespace intervale {

// Whether a mesh can be written to this path, by its extension; misuse with the list of extensions otherwise. Call before long work.
Result<void> check_mesh_path(const std::filesystem::path& path);

// Writes a mesh by the extension of path, aside and renamed. An empty mesh is a valid empty file.
Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace intervale
