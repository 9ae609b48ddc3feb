#include "common/picture/picture.h"

#include <fmt/core.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "common/patch/channel_bounds.h"
#include "common/picture/canvas.h"
#include "common/picture/colour_bar.h"
#include "common/picture/triangles.h"
#include "common/picture/viewpoint.h"
#include "common/picture/volume_picture.h"
#include "common/util/atomic_file.h"
#include "common/view/palette.h"

namespace intervale {
namespace {

// Four samples a pixel, with depth, take 32 bytes: about a gigabyte. 8K screens have slightly fewer pixels.
constexpr std::int64_t kMostPixels = std::int64_t{1} << 25;

// The longest box that can be drawn, and the inverse of the shortest: doubles hold products of four lengths.
constexpr double kMostLength = 1e75;

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

Result<void> check_box(const PictureOptions& options, const Box& box) {
  const double diagonal = length(subtract(box.max, box.min)), farthest = std::max(length(box.min), length(box.max));
  if (diagonal >= 1 / kMostLength && farthest <= kMostLength) return {};
  return fail(fmt::format("cannot draw '{}': the volume is {:g} long and up to {:g} from the origin; a picture shows {:g} to {:g}",
                          options.file.string(), diagonal, farthest, 1 / kMostLength, kMostLength));
}

Result<void> check_render(const PictureOptions& options) {
  if (options.render == Render::surface) {
    if (options.opacity) return misuse("--opacity needs --render volume");
    return {};
  }
  if (options.edges) return misuse("--edges does not go with --render volume");
  if (options.colour_by == ColourBy::surface) return misuse("--color-by surface does not go with --render volume");
  if (options.colour_by == ColourBy::channel) return misuse("a channel's colours do not go with --render volume");
  return {};
}

Result<void> check_colours(const PictureOptions& options) {
  const auto& span = options.colour_span;
  if (!is_by_value(options)) {
    if (options.palette) return misuse("--palette needs --color-by value or a channel");
    if (span) return misuse("--color-span needs --color-by value or a channel");
    return {};
  }
  if (options.palette && !find_palette(*options.palette))
    return misuse("--palette: there is no palette '" + *options.palette + "'; choose " + palette_list());
  if (span && !(std::isfinite(span->low) && std::isfinite(span->high) && span->low < span->high))
    return misuse("--color-span: LO and HI must be finite numbers, and LO less than HI");
  return {};
}

// What a picture shows in colours of values.
struct Colours {
  Palette palette;
  ValueSpan span;
  MeshArray<double> of_points;  // of a channel
  std::string title;
};

// The numbers that a channel's colours stand for, one for each point: its values, or the lengths of its vectors.
MeshArray<double> numbers_of(const PointArray& channel) {
  if (channel.components == 1) return channel.value;
  MeshArray<double> lengths(channel.value.size() / channel.components);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double* const v = &channel.value[i * channel.components];
    lengths[i] = std::hypot(v[0], v[1], v[2]);
  }
  return lengths;
}

Colours colours_of_channel(const PictureOptions& options, const PictureSubject& subject, const Palette& palette) {
  const auto has_name = [&options](const auto& channel) { return channel.name == options.channel; };
  const auto& here = subject.mesh.channels;
  const auto& channels = subject.description.channels;
  const auto found = std::find_if(here.begin(), here.end(), has_name);
  const auto channel = std::find_if(channels.begin(), channels.end(), has_name);
  const auto [least, greatest] = bounds_of(*channel);
  return {palette, options.colour_span ? *options.colour_span : ValueSpan{least, greatest}, numbers_of(*found),
          title_of(channel->name, channel->unit)};
}

std::optional<Colours> colours_of(const PictureOptions& options, const PictureSubject& subject) {
  if (!is_by_value(options)) return {};
  const Palette palette = *find_palette(options.palette ? *options.palette : kPaletteNames[0]);
  if (options.colour_by == ColourBy::channel) return colours_of_channel(options, subject, palette);
  const Labels& labels = subject.description.labels;
  return Colours{palette,
                 options.colour_span ? *options.colour_span : span_of(subject.description, subject.range),
                 {},
                 title_of(labels.field, labels.field_unit)};
}

Result<Pixels> draw_surfaces(const PictureOptions& options, const Mesh& mesh, const std::optional<Colours>& colours, const Camera& camera,
                             const Box& box) {
  const Viewpoint viewpoint(camera, box);
  TriangleOptions triangles{options.clip, options.edges, {}};
  std::optional<Palette> palette;
  if (colours) {
    palette = colours->palette;
    triangles.span = colours->span;
    triangles.values = colours->of_points.empty() ? std::span<const double>(mesh.value) : colours->of_points;
  }
  auto canvas = Canvas::create(camera.viewport, viewpoint, palette);
  if (!canvas) return tl::unexpected(canvas.error());
  for_each_triangle(mesh, triangles, viewpoint, [&canvas](std::span<const Corner> corners) { canvas->draw(corners); });
  return canvas->finish();
}

}  // namespace

bool is_by_value(const PictureOptions& options) {
  return options.render == Render::volume || options.colour_by == ColourBy::value || options.colour_by == ColourBy::channel;
}

Result<void> check_picture(const PictureOptions& options, const std::optional<Camera>& camera) {
  const std::string ending = options.file.extension().string();
  if (!ending.empty() && ending != ".png" && ending != ".PNG")
    return misuse("cannot draw '" + options.file.string() + "': pictures are PNG files; name it .png");
  if (options.clip) {
    if (auto checked = check_plane(*options.clip); !checked) return checked;
  }
  if (auto checked = check_render(options); !checked) return checked;
  if (auto checked = check_colours(options); !checked) return checked;
  if (!camera) return {};
  const auto [width, height] = camera->viewport;
  if (std::int64_t{width} * height > kMostPixels)
    return misuse(fmt::format("a picture has at most {} pixels, not {} x {}; take a smaller viewport", kMostPixels, width, height));
  return {};
}

Result<bool> write_picture(const PictureOptions& options, const PictureSubject& subject, const std::optional<Camera>& camera,
                           const ParallelFor& parallel) {
  const Box box = box_of(subject.description.grid);
  if (auto drawable = check_box(options, box); !drawable) return tl::unexpected(drawable.error());
  const Camera seen_from = camera ? *camera : three_quarter_view(box, options.clip);
  const auto colours = colours_of(options, subject);
  Result<Pixels> pixels;
  if (options.render == Render::volume) {
    const ValueSpan values = span_of(subject.description, subject.range);
    const VolumeLook look{options.opacity ? *options.opacity : default_opacity(values), colours->palette, colours->span};
    pixels = draw_volume(subject.mesh, {seen_from, box, options.clip, values}, look, parallel);
  } else {
    pixels = draw_surfaces(options, subject.mesh, colours, seen_from, box);
  }
  if (!pixels) return tl::unexpected(pixels.error());
  if (colours) draw_colour_bar(*pixels, colours->palette, colours->span, colours->title);
  if (auto written = write_png(options.file, *pixels); !written) return tl::unexpected(written.error());
  return pixels->has_drawing;
}

}  // namespace intervale
