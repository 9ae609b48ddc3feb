// Mesh files: .vtu holds the tetrahedra; .vtp, .ply, .stl, .obj and .glb hold the boundary's triangles, oriented
// outward. .vtu and .vtp also hold the values of the points and the channels, if the mesh has them, and .vtu the range
// of each tetrahedron of a mesh of several.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>

#include "common/mesh/mesh.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

// Takes the bytes of a file from front to back.
using ByteSink = std::function<Result<void>(std::span<const std::byte>)>;

// Whether a mesh can be written to this path, by its extension; misuse with the list of extensions otherwise. Call
// before long work.
INTERVALE_EXPORT Result<void> check_mesh_path(const std::filesystem::path& path);

// Writes a mesh in the format of path's extension. An empty mesh is a valid empty file. Fails on coordinates that the
// format cannot hold: infinite ones and NaN; for .stl and .glb, those beyond 32-bit floats.
INTERVALE_EXPORT Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh);  // an AtomicFile
INTERVALE_EXPORT Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh,
                                         const ByteSink& sink);  // opens no file; path also names it in errors

}  // namespace intervale
