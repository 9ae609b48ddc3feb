// Sample volumes, computed from formulas.
#pragma once

#include <span>
#include <string_view>

#include "common/patch/volume.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr int kMinSampleSize = 2;     // samples a side
inline constexpr int kMaxSampleSize = 1024;  // of a volume in memory

// buckyball: Gaussians at the atoms of C60, 0 to 255; atoms and bonds lie in [128, 188].
// gyroid: sin x cos y + sin y cos z + sin z cos x over two periods, -1.5 to 1.5; 0 is the minimal surface.
// marschner-lobb: the test signal for reconstruction filters, f_M = 6, alpha = 0.25, 0 to 255.
// hydrogen: the probability density of the 3d_z2 orbital, 0 to 255.
INTERVALE_EXPORT std::span<const std::string_view> sample_names();

// A cube of size^3 samples of type f32 over [-1, 1]^3; misuse for an unknown name or a size out of bounds. The result
// does not depend on the number of threads. O(size^3), buckyball a few times slower than the others.
INTERVALE_EXPORT Result<Volume> make_sample(std::string_view name, int size);

}  // namespace intervale
