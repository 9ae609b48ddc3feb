#include "server/volume/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "common/patch/description.h"

namespace intervale {
namespace {

std::string because(const char* what, const std::filesystem::path& path, int error) {
  return std::string("cannot ") + what + " " + in_quotes(path) + ": " + std::generic_category().message(error);
}

}  // namespace

InputFile::InputFile(std::filesystem::path path, int descriptor, std::uint64_t size) : path_(std::move(path)), descriptor_(descriptor), size_(size) {}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_) {}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  // O_NONBLOCK: opening a pipe must not wait for somebody to write to it. It changes nothing for a regular file.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return fail(because("read", path, errno));
  struct stat status {};
  const int error = ::fstat(descriptor, &status) == 0 ? 0 : errno;
  InputFile file(path, descriptor, static_cast<std::uint64_t>(std::max<off_t>(status.st_size, 0)));
  if (error != 0) return fail(because("read", path, error));
  if (!S_ISREG(status.st_mode)) return fail("cannot read '" + path.string() + "': it is not a regular file; copy the data into one first");
  return file;
}

// Signals wait for the system's calls, and those that keep a build within its memory should not wait long.
constexpr std::size_t kMostAtOnce = 1 << 20;

Result<std::size_t> InputFile::read_some(std::uint64_t offset, std::span<std::byte> out) const {
  std::size_t done = 0;
  while (done < out.size() && offset + done < size_) {
    const auto got = ::pread(descriptor_, out.data() + done, std::min(out.size() - done, kMostAtOnce), static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return fail(because("read", path_, errno));
    if (got == 0) break;  // the file has shrunk since
    done += static_cast<std::size_t>(got);
  }
  return done;
}

Result<void> InputFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  const auto got = read_some(offset, out);
  if (!got) return tl::unexpected<Error>(got.error());
  if (*got == out.size()) return {};
  return fail(in_quotes(path_) + " ends after " + std::to_string(offset + *got) + " bytes, where " + std::to_string(offset + out.size()) +
              " are needed; is it cut short?");
}

std::string in_quotes(const std::filesystem::path& path) {
  std::string text = "'";
  return text.append(path.string()).append("'");
}

Result<Grid> make_grid(const std::array<std::int64_t, 3>& dims, const Affine& affine, const std::string& where) {
  Grid grid{{}, affine};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (dims[axis] < kMinSide || dims[axis] > kMaxSide)
      return fail(where + ": " + std::to_string(dims[axis]) + (dims[axis] == 1 ? " sample" : " samples") + " on axis " + "xyz"[axis] +
                  "; a volume has " + std::to_string(kMinSide) + " to " + std::to_string(kMaxSide));
    grid.dims[axis] = std::int32_t(dims[axis]);
  }
  if (const auto checked = check_grid(grid); !checked) return fail(where + ": " + checked.error().message);
  return grid;
}

void swap_bytes(std::span<std::byte> samples, SampleType type) {
  const std::size_t size = size_of(type);
  for (; samples.size() >= size; samples = samples.subspan(size)) std::reverse(samples.begin(), samples.begin() + std::ptrdiff_t(size));
}

}  // namespace intervale
