// Bytes as an NRRD file.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "server/volume/nrrd.h"

// teem's reader loses a small array for some headers that it refuses (_nrrdRead, teem 1.12).
extern "C" const char* __lsan_default_suppressions() { return "leak:airArrayNew\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = ::memfd_create("fuzzed.nrrd", MFD_CLOEXEC);
  if (file < 0) std::abort();
  for (std::size_t done = 0; done < size;) {
    const ssize_t n = ::write(file, data + done, size - done);
    if (n <= 0) std::abort();
    done += std::size_t(n);
  }
  const auto volume = intervale::read_nrrd("/proc/self/fd/" + std::to_string(file));
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
