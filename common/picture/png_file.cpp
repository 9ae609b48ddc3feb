#include "common/picture/png_file.h"

#include <png.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/util/atomic_file.h"

namespace intervale {

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

}  // namespace intervale
