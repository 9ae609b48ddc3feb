#include "server/volume/raw_reader.h"

#include <bit>
#include <limits>
#include <string>

#include "server/volume/input_file.h"
#include "server/volume/volume_reader.h"

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

Result<std::unique_ptr<VolumeReader>> open_raw(const std::filesystem::path& path, const RawLayout& layout) {
  const auto grid = make_grid(layout.dims, layout.affine, "the layout of '" + path.string() + "'");
  if (!grid) return misuse(grid.error().message);
  VolumeHeader header;
  header.type = layout.type;
  header.grid = *grid;
  header.big_endian = layout.big_endian;
  header.data_offset = layout.skip_bytes;

  const std::uint64_t bytes = header.data_bytes();  // at most 2^63
  if (layout.skip_bytes > std::numeric_limits<std::uint64_t>::max() - bytes) return misuse("--skip is larger than any file");
  const std::uint64_t expected = layout.skip_bytes + bytes;
  const auto file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  if (file->size() != expected)
    return fail(in_quotes(path) + " is " + std::to_string(file->size()) + " bytes, too " + (file->size() < expected ? "short" : "long") + " for " +
                shape_of(layout) + (layout.skip_bytes > 0 ? " after " + std::to_string(layout.skip_bytes) + " skipped bytes" : "") + ", which take " +
                std::to_string(expected) + "; check --dims, --type and --skip");
  return open_samples(*file, header);
}

}  // namespace intervale
