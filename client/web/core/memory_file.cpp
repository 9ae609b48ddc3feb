// AtomicFile (common/util/atomic_file.h) for a program without a file system.
#include "client/web/core/memory_file.h"

#include <utility>

#include "common/util/atomic_file.h"

namespace intervale {
namespace {

std::vector<std::byte> committed;

}  // namespace

std::vector<std::byte> take_committed_file() { return std::exchange(committed, {}); }

AtomicFile::AtomicFile(std::filesystem::path path, std::filesystem::path beside, int descriptor)
    : path_(std::move(path)), beside_(std::move(beside)), descriptor_(descriptor) {}
AtomicFile::AtomicFile(AtomicFile&& other) noexcept = default;
AtomicFile::~AtomicFile() = default;

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& path) { return AtomicFile(path, {}, 0); }

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return {};
}

Result<void> AtomicFile::commit() {
  committed = std::move(buffer_);
  return {};
}

}  // namespace intervale
