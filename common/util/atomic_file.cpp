#include "common/util/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cassert>
#include <cerrno>
#include <cstdint>
#include <random>
#include <string>
#include <system_error>
#include <utility>

namespace intervale {
namespace {

constexpr std::size_t kBufferBytes = 1 << 20;
constexpr int kNameAttempts = 16;

tl::unexpected<Error> failed(const char* what, const std::filesystem::path& path, int error) {
  return fail(std::string("cannot ") + what + " '" + path.string() + "': " + std::generic_category().message(error));
}

// The file that a link points to is replaced, not the link.
std::filesystem::path resolve_link(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_symlink(path, ignored)) return path;
  const auto target = std::filesystem::canonical(path, ignored);
  return target.empty() ? path : target;
}

// Short, and independent of the final name, which may already have 255 bytes, the most that a file system permits.
std::string unique_name() {
  static std::atomic<std::uint64_t> counter{0};
  static const std::uint64_t salt = std::random_device{}();
  return ".intervale-" + std::to_string(::getpid()) + "-" + std::to_string(salt) + "-" + std::to_string(counter.fetch_add(1)) + ".part";
}

Result<void> write_all(int descriptor, const std::byte* data, std::size_t size, const std::filesystem::path& path) {
  while (size > 0) {
    const ssize_t written = ::write(descriptor, data, size);
    if (written < 0) {
      if (errno == EINTR) continue;
      return failed("write", path, errno);
    }
    data += written;
    size -= static_cast<std::size_t>(written);
  }
  return {};
}

// Makes the rename durable. EINVAL: the file system cannot sync folders, which is no error.
Result<void> sync_folder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0)
    // Writable but not readable: cannot be synced.
    return errno == EACCES ? Result<void>{} : failed("open the folder", folder, errno);
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  if (error != 0 && error != EINVAL) return failed("sync the folder", folder, error);
  return {};
}

std::filesystem::path folder_of(const std::filesystem::path& path) { return path.has_parent_path() ? path.parent_path() : "."; }

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path, std::filesystem::path beside, int descriptor)
    : path_(std::move(path)), beside_(std::move(beside)), descriptor_(descriptor) {
  buffer_.reserve(kBufferBytes);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      beside_(std::move(other.beside_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      buffer_(std::move(other.buffer_)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  if (!beside_.empty()) ::unlink(beside_.c_str());
}

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& requested) {
  if (requested.empty()) return misuse("the name of the output file is empty");
  const auto path = resolve_link(requested);
  struct stat status {};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) return fail("cannot write '" + path.string() + "': it is a folder: name a file in it");
  if (exists && !S_ISREG(status.st_mode)) {
    // A device or a pipe: a rename would replace it with a file, and it has no contents to protect. beside_ stays
    // empty.
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) return failed("write", path, errno);
    return AtomicFile(path, {}, descriptor);
  }
  if (!path.has_filename()) return fail("cannot write '" + path.string() + "': it is a folder: name a file in it");
  const auto folder = folder_of(path);
  for (int attempt = 0; attempt < kNameAttempts; ++attempt) {
    auto beside = folder / unique_name();
    const int descriptor = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) {
      // Keeps the permissions of the replaced file, if permitted.
      if (exists) (void)::fchmod(descriptor, status.st_mode & 07777);
      return AtomicFile(path, std::move(beside), descriptor);
    }
    if (errno == ENOENT) return fail("cannot write '" + path.string() + "': the folder '" + folder.string() + "' does not exist");
    if (errno != EEXIST) return failed("write", path, errno);
  }
  return failed("create a temporary file beside", path, EEXIST);
}

Result<void> AtomicFile::flush() {
  auto result = write_all(descriptor_, buffer_.data(), buffer_.size(), path_);
  buffer_.clear();
  return result;
}

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
  assert(descriptor_ >= 0 && "write() after commit()");
  if (buffer_.size() + bytes.size() > kBufferBytes) {
    if (auto flushed = flush(); !flushed) return flushed;
    if (bytes.size() >= kBufferBytes) return write_all(descriptor_, bytes.data(), bytes.size(), path_);
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return {};
}

Result<void> AtomicFile::commit() {
  assert(descriptor_ >= 0 && "second commit()");
  if (auto flushed = flush(); !flushed) return flushed;
  // Without a sync before the rename, a power failure may leave an empty file. Pipes and some devices cannot sync.
  if (::fsync(descriptor_) != 0 && !beside_.empty()) return failed("write", path_, errno);
  const int descriptor = std::exchange(descriptor_, -1);
  const int close_error = ::close(descriptor) == 0 ? 0 : errno;
  if (beside_.empty()) return close_error == 0 ? Result<void>{} : failed("write", path_, close_error);
  const int error = close_error != 0 ? close_error : (::rename(beside_.c_str(), path_.c_str()) == 0 ? 0 : errno);
  if (error != 0) {
    ::unlink(beside_.c_str());
    return failed("write", path_, error);
  }
  return sync_folder(folder_of(path_));
}

}  // namespace intervale
