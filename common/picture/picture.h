// A picture of a mesh, drawn without a display and written as PNG.
//
// The alpha surface is blue, the beta surface orange; the sides of the box and cuts through the inside are sand. Or
// everything has the colour of the field's value there, and the picture a colour bar. Or the mesh is no solid, but a
// cloud of the field's values: volume rendering.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/mesh/mesh.h"
#include "common/mesh/plane_cut.h"
#include "common/patch/description.h"
#include "common/picture/value_span.h"
#include "common/util/parallel.h"
#include "common/util/result.h"
#include "common/view/lod.h"
#include "common/view/transfer_function.h"

namespace intervale {

enum class Render : std::uint8_t { surface, volume };
enum class ColourBy : std::uint8_t { surface, value, channel };

struct PictureOptions {
  std::filesystem::path file;
  std::optional<Plane> clip;  // cuts away what lies on its normal's side, and shows the tetrahedra behind it cut (plane_cut.h)
  bool edges = false;         // whether the mesh's edges are drawn on its boundary too; of surfaces only
  Render render = Render::surface;
  std::optional<OpacityCurve> opacity;  // of volumes only: of a hundredth of the box's diagonal; or default_opacity()
  std::optional<ColourBy> colour_by;    // or the surface; of volumes the value, and nothing else
  std::string channel;                  // by channel: its name. Vectors have the colours of their lengths
  // By value or channel only:
  std::optional<std::string> palette;    // a name of kPaletteNames; or the first
  std::optional<ValueSpan> colour_span;  // what lies beyond has the colours of the palette's ends; or span_of(), or bounds_of() the channel
};

// Misuse if the options are invalid for every mesh: call this before long work. camera: valid by check_lod; see
// write_picture.
[[nodiscard]] Result<void> check_picture(const PictureOptions& options, const std::optional<Camera>& camera);

// Whether colours are those of values: of the field or of a channel.
[[nodiscard]] bool is_by_value(const PictureOptions& options);

// What a picture is of. By value, the mesh has values; by channel, that channel.
struct PictureSubject {
  const Mesh& mesh;
  const Description& description;
  Range range;  // that the mesh is made for
};

// Draws what the camera sees, in the size of its viewport, and writes it to a temporary file that is renamed. Without a
// camera: the whole box in a three-quarter view, 1280 x 960 pixels. Returns whether anything of the mesh is in it;
// otherwise it is background, with the colour bar if there is one. Equal meshes give equal pictures on one machine,
// whatever the order of their points and tetrahedra. The options are valid by check_picture. Surfaces take some 0.3 s,
// and a second for a million triangles; they fail where there is no EGL, with what to install. Volumes take longer, and
// use `parallel` (volume_rays.h). One thread at a time.
[[nodiscard]] Result<bool> write_picture(const PictureOptions& options, const PictureSubject& subject, const std::optional<Camera>& camera,
                                         const ParallelFor& parallel = serial);

}  // namespace intervale
