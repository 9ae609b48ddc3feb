// Bytes as a file of any format that volumes are read from.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"

// teem's reader loses a small array for some headers that it refuses (_nrrdRead, teem 1.12).
extern "C" [[gnu::visibility("default")]] const char* __lsan_default_suppressions() { return "leak:airArrayNew\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = ::memfd_create("fuzzed", MFD_CLOEXEC);
  if (file < 0) std::abort();
  for (std::size_t done = 0; done < size;) {
    const ssize_t n = ::write(file, data + done, size - done);
    if (n <= 0) std::abort();
    done += std::size_t(n);
  }
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  const auto header = intervale::read_volume_header(path);
  const bool has_several = header && *header && (*header)->time_points > 1;
  const auto volume = intervale::read_volume(path, {}, has_several ? std::optional((*header)->time_points - 1) : std::nullopt);
  ::close(file);
  if (!volume) {
    if (volume.error().message.empty()) std::abort();
    return 0;
  }
  if (volume->bytes.size() != volume->grid.sample_count() * volume->components * intervale::size_of(volume->type)) std::abort();
  for (std::int32_t side : volume->grid.dims) {
    if (side < intervale::kMinSide || side > intervale::kMaxSide) std::abort();
  }
  return 0;
}
