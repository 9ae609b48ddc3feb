// Volume rendering as a picture: all of a mesh, as a cloud that glows in the colours of the field's values.
#pragma once

#include "common/mesh/mesh.h"
#include "common/picture/pixels.h"
#include "common/picture/value_span.h"
#include "common/picture/volume_rays.h"
#include "common/util/parallel.h"
#include "common/view/palette.h"
#include "common/view/transfer_function.h"

namespace intervale {

// How values look.
struct VolumeLook {
  OpacityCurve opacity;  // of a hundredth of the box's diagonal
  Palette palette;
  ValueSpan colours;  // the values at the palette's ends
};

// From nothing at the least of the values to as much at the greatest as shows what is behind, too.
[[nodiscard]] OpacityCurve default_opacity(const ValueSpan& values);

// The rays' light on the background that all pictures have; each pixel is the mean of four rays. rays.camera is that of
// the picture. The mesh has values.
[[nodiscard]] Pixels draw_volume(const Mesh& mesh, const VolumeRays& rays, const VolumeLook& look, const ParallelFor& parallel);

}  // namespace intervale
