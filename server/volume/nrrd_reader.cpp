#include "server/volume/nrrd.h"
#include "server/volume/nrrd_header.h"
#include "server/volume/volume_reader.h"

namespace intervale {

Result<Volume> read_nrrd(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  const auto header = read_nrrd_header(*file);
  if (!header) return tl::unexpected<Error>(header.error());
  const auto reader = open_samples(*file, *header);
  if (!reader) return tl::unexpected<Error>(reader.error());
  auto volume = read_samples(**reader);
  if (volume) volume->name = path.stem().string();
  return volume;
}

}  // namespace intervale
