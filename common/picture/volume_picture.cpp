#include "common/picture/volume_picture.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace intervale {
namespace {

constexpr double kMostByDefault = 0.3;
constexpr int kRaysAcross = 2;  // rays of a pixel, each way

// As the shaders have them (shaders.h).
constexpr double kGamma = 2.2;
Palette::Colour background(int row, int height) {
  const double t = std::clamp((height - row - 0.5) / height + 0.1, 0.0, 1.0), up = t * t * (3 - 2 * t);
  return {0.83 + 0.15 * up, 0.86 + 0.125 * up, 0.90 + 0.09 * up};
}

TransferFunction transfer_of(const VolumeLook& look, const ValueSpan& values) {
  return TransferFunction([&](double place) {
    const double value = values.low + place * values.high - place * values.low;
    Palette::Colour colour = look.palette.at(look.colours.at(value));
    for (double& channel : colour) channel = std::pow(channel, kGamma);
    return TransferFunction::Optics{opacity_at(look.opacity, value), colour};
  });
}

// The pixel of the rays whose first one is light[0]. across: rays in a row of the tile.
void write_pixel(std::span<const RayLight> light, std::size_t across, const Palette::Colour& behind, std::uint8_t* rgb) {
  for (std::size_t k = 0; k < 3; ++k) {
    double sum = 0;
    for (const std::size_t ray : {std::size_t(0), std::size_t(1), across, across + 1}) sum += light[ray].colour[k] + light[ray].passes * behind[k];
    rgb[k] = std::uint8_t(std::lround(255 * std::pow(std::min(sum / (kRaysAcross * kRaysAcross), 1.0), 1 / kGamma)));
  }
}

}  // namespace

OpacityCurve default_opacity(const ValueSpan& values) {
  if (!(values.low < values.high)) return {{values.low, kMostByDefault}};
  return {{values.low, 0}, {values.high, kMostByDefault}};
}

Pixels draw_volume(const Mesh& mesh, const VolumeRays& rays, const VolumeLook& look, const ParallelFor& parallel) {
  const int width = rays.camera.viewport[0], height = rays.camera.viewport[1];
  Pixels pixels{width, height, std::vector<std::uint8_t>(3 * std::size_t(width) * std::size_t(height)), false};
  VolumeRays finer = rays;
  for (int& side : finer.camera.viewport) side *= kRaysAcross;
  std::atomic<bool> has_drawing = false;
  trace_rays(mesh, finer, transfer_of(look, rays.values), parallel, [&](const RayTile& tile, std::span<const RayLight> light) {
    const std::size_t across = std::size_t(tile.right - tile.left);
    if (std::any_of(light.begin(), light.end(), [](const RayLight& ray) { return ray.passes < 1; })) has_drawing = true;
    for (int row = tile.top / kRaysAcross; row < tile.bottom / kRaysAcross; ++row) {
      const Palette::Colour behind = background(row, height);
      for (int column = tile.left / kRaysAcross; column < tile.right / kRaysAcross; ++column) {
        const std::size_t first = std::size_t(row * kRaysAcross - tile.top) * across + std::size_t(column * kRaysAcross - tile.left);
        write_pixel(light.subspan(first), across, behind, pixels.rgb.data() + 3 * (std::size_t(row) * std::size_t(width) + std::size_t(column)));
      }
    }
  });
  pixels.has_drawing = has_drawing;
  return pixels;
}

}  // namespace intervale
