#include "server/volume/nrrd.h"
#include "server/volume/nrrd_header.h"

namespace intervale {

Result<Volume> read_nrrd(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  const auto header = read_nrrd_header(*file);
  if (!header) return tl::unexpected<Error>(header.error());
  return read_data(*file, *header);
}

}  // namespace intervale
