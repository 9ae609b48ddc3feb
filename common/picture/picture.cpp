#include "common/picture/picture.h"

#include <fmt/core.h>
#include <png.h>

#include <cstdint>
#include <string>
#include <vector>

#include "common/picture/canvas.h"
#include "common/picture/triangles.h"
#include "common/picture/viewpoint.h"
#include "common/util/atomic_file.h"

namespace intervale {
namespace {

// Four samples a pixel, with depth, take 32 bytes: about a gigabyte. 8K screens have slightly fewer pixels.
constexpr std::int64_t kMostPixels = std::int64_t{1} << 25;

Result<void> write_png(const std::filesystem::path& path, const Pixels& pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(pixels.width);
  image.height = png_uint_32(pixels.height);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.rgb.data(), 0, nullptr) == 0)
    return fail("cannot write '" + path.string() + "': " + std::begin(image.message));
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  if (auto written = file->write(std::span(bytes).first(size)); !written) return written;
  return file->commit();
}

}  // namespace

Result<void> check_picture(const PictureOptions& options, const std::optional<Camera>& camera) {
  const std::string ending = options.file.extension().string();
  if (!ending.empty() && ending != ".png" && ending != ".PNG")
    return misuse("cannot draw '" + options.file.string() + "': pictures are PNG files; name it .png");
  if (options.clip) {
    if (auto checked = check_plane(*options.clip); !checked) return checked;
  }
  if (!camera) return {};
  const auto [width, height] = camera->viewport;
  if (std::int64_t{width} * height > kMostPixels)
    return misuse(fmt::format("a picture has at most {} pixels, not {} x {}; take a smaller viewport", kMostPixels, width, height));
  return {};
}

Result<void> write_picture(const PictureOptions& options, const Mesh& mesh, const Box& box, const std::optional<Camera>& camera) {
  const Camera seen_from = camera ? *camera : three_quarter_view(box, options.clip);
  const Viewpoint viewpoint(seen_from, box);
  auto canvas = Canvas::create(seen_from.viewport, viewpoint);
  if (!canvas) return tl::unexpected(canvas.error());
  for_each_triangle(mesh, {options.clip, options.edges}, viewpoint, [&canvas](std::span<const Corner> corners) { canvas->draw(corners); });
  const auto pixels = canvas->finish();
  if (!pixels) return tl::unexpected(pixels.error());
  return write_png(options.file, *pixels);
}

}  // namespace intervale
