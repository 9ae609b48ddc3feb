// A picture of a mesh, drawn without a display and written as PNG.
//
// The alpha surface is blue, the beta surface orange, and where the box or a cut goes through the inside it is sand.
#pragma once

#include <filesystem>
#include <optional>

#include "common/mesh/mesh.h"
#include "common/mesh/plane_cut.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct PictureOptions {
  std::filesystem::path file;
  std::optional<Plane> clip;  // what lies on its normal's side is cut away, and the tetrahedra behind it are seen cut
  bool edges = false;         // whether the mesh's edges are drawn on its boundary too
};

// Misuse if no such picture can be, whatever the mesh: call before long work. camera: one that check_lod lets pass; see write_picture.
[[nodiscard]] Result<void> check_picture(const PictureOptions& options, const std::optional<Camera>& camera);

// Draws what the camera sees, as large as its viewport, and writes it, aside and renamed. Without a camera: the whole box, from above and aside,
// 1280 x 960 pixels. An empty mesh gives the background. Equal meshes give equal pictures on one machine, whatever
// the order of their points and tetrahedra. Options that check_picture lets pass. Takes some 0.3 s, and a second for a million triangles; fails where
// there is no EGL, with what to install. One thread at a time.
[[nodiscard]] Result<void> write_picture(const PictureOptions& options, const Mesh& mesh, const Box& box, const std::optional<Camera>& camera);

}  // namespace intervale
