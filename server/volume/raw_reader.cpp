#include "server/volume/raw_reader.h"

#include <bit>
#include <limits>
#include <string>

#include "server/volume/input_file.h"

namespace intervale {
namespace {

static_assert(std::endian::native == std::endian::little, "volumes are swapped on the ground that the machine is little endian");

std::string shape_of(const RawLayout& layout) {
  return std::to_string(layout.dims[0]) + " x " + std::to_string(layout.dims[1]) + " x " + std::to_string(layout.dims[2]) + " samples of " +
         name_of(layout.type);
}

}  // namespace

Result<SampleType> parse_sample_type(std::string_view name) {
  for (std::size_t i = 0; i < std::tuple_size_v<SampleTypes>; ++i)
    if (name == name_of(SampleType(i))) return SampleType(i);
  return misuse("unknown sample type '" + std::string(name) + "': use u8, i8, u16, i16, u32, i32, f32 or f64");
}

Result<Volume> read_raw(const std::filesystem::path& path, const RawLayout& layout) {
  const auto grid = make_grid(layout.dims, layout.affine, "the layout of '" + path.string() + "'");
  if (!grid) return misuse(grid.error().message);
  Volume volume;
  volume.name = path.stem().string();
  volume.type = layout.type;
  volume.grid = *grid;

  const std::uint64_t bytes = volume.grid.sample_count() * size_of(layout.type);  // at most 2^63
  if (layout.skip_bytes > std::numeric_limits<std::uint64_t>::max() - bytes) return misuse("--skip is larger than any file");
  const std::uint64_t expected = layout.skip_bytes + bytes;
  auto file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  if (file->size() != expected)
    return fail(in_quotes(path) + " is " + std::to_string(file->size()) + " bytes, too " + (file->size() < expected ? "short" : "long") + " for " +
                shape_of(layout) + (layout.skip_bytes > 0 ? " after " + std::to_string(layout.skip_bytes) + " skipped bytes" : "") + ", which take " +
                std::to_string(expected) + "; check --dims, --type and --skip");
  volume.bytes.resize(bytes);
  if (auto read = file->read(layout.skip_bytes, volume.bytes); !read) return tl::unexpected<Error>(read.error());
  if (layout.big_endian) swap_bytes(volume.bytes, volume.type);
  return volume;
}

}  // namespace intervale
