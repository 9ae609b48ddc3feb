#include "common/picture/picture.h"

#include <fmt/core.h>
#include <png.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "common/picture/canvas.h"
#include "common/picture/colour_bar.h"
#include "common/picture/triangles.h"
#include "common/picture/viewpoint.h"
#include "common/util/atomic_file.h"
#include "common/view/palette.h"

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

Result<void> check_colours(const PictureOptions& options) {
  const auto& span = options.colour_span;
  if (options.colour_by != ColourBy::value) {
    if (options.palette) return misuse("--palette needs --color-by value");
    if (span) return misuse("--color-span needs --color-by value");
    return {};
  }
  if (options.palette && !find_palette(*options.palette))
    return misuse("--palette: there is no palette '" + *options.palette + "'; choose " + palette_list());
  if (span && !(std::isfinite(span->low) && std::isfinite(span->high) && span->low < span->high))
    return misuse("--color-span: LO and HI must be finite numbers, and LO less than HI");
  return {};
}

}  // namespace

Result<void> check_picture(const PictureOptions& options, const std::optional<Camera>& camera) {
  const std::string ending = options.file.extension().string();
  if (!ending.empty() && ending != ".png" && ending != ".PNG")
    return misuse("cannot draw '" + options.file.string() + "': pictures are PNG files; name it .png");
  if (options.clip) {
    if (auto checked = check_plane(*options.clip); !checked) return checked;
  }
  if (auto checked = check_colours(options); !checked) return checked;
  if (!camera) return {};
  const auto [width, height] = camera->viewport;
  if (std::int64_t{width} * height > kMostPixels)
    return misuse(fmt::format("a picture has at most {} pixels, not {} x {}; take a smaller viewport", kMostPixels, width, height));
  return {};
}

Result<bool> write_picture(const PictureOptions& options, const PictureSubject& subject, const std::optional<Camera>& camera) {
  const Box box = box_of(subject.description.grid);
  const Camera seen_from = camera ? *camera : three_quarter_view(box, options.clip);
  const Viewpoint viewpoint(seen_from, box);
  TriangleOptions triangles{options.clip, options.edges, {}};
  std::optional<Palette> palette;
  if (options.colour_by == ColourBy::value) {
    palette = find_palette(options.palette ? *options.palette : kPaletteNames[0]);
    triangles.span = options.colour_span ? *options.colour_span : span_of(subject.description, subject.range);
  }
  auto canvas = Canvas::create(seen_from.viewport, viewpoint, palette);
  if (!canvas) return tl::unexpected(canvas.error());
  for_each_triangle(subject.mesh, triangles, viewpoint, [&canvas](std::span<const Corner> corners) { canvas->draw(corners); });
  auto pixels = canvas->finish();
  if (!pixels) return tl::unexpected(pixels.error());
  if (palette) draw_colour_bar(*pixels, *palette, *triangles.span, title_of(subject.description.labels));
  if (auto written = write_png(options.file, *pixels); !written) return tl::unexpected(written.error());
  return pixels->has_drawing;
}

}  // namespace intervale
