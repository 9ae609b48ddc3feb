#include "server/cluster/shared_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "common/util/atomic_file.h"

namespace intervale {
namespace {

Result<void> write_at(int file, std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(file, bytes.data(), bytes.size(), off_t(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return fail(std::generic_category().message(errno));
    offset += std::uint64_t(written);
    bytes = bytes.subspan(std::size_t(written));
  }
  return {};
}

Result<void> write_pieces(const std::filesystem::path& path, std::span<const SharedPiece> pieces) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return fail(std::generic_category().message(errno));
  Result<void> result;
  for (const SharedPiece& piece : pieces) {
    if (result) result = write_at(file, piece.offset, piece.bytes);
  }
  if (result && ::fsync(file) != 0) result = fail(std::generic_category().message(errno));
  if (::close(file) != 0 && result) result = fail(std::generic_category().message(errno));
  return result;
}

}  // namespace

Result<void> write_shared_file(Ranks& ranks, const std::filesystem::path& path, std::span<const SharedPiece> pieces,
                               const std::function<void(const std::filesystem::path&)>& writes) {
  std::optional<AtomicFile> file;
  Result<void> result;
  std::string temporary;
  if (ranks.rank() == 0) {
    auto made = AtomicFile::create(path);
    if (!made) {
      result = tl::unexpected(made.error());
    } else if (made->temporary().empty()) {
      result = misuse("several ranks write to a regular file only, not to '" + path.string() + "'");
    } else {
      temporary = std::filesystem::absolute(made->temporary()).string();
      file.emplace(std::move(*made));
    }
  }
  if (auto ok = agree(ranks, result); !ok) return ok;
  const std::vector<char> name = joined<char>(ranks, temporary);  // of rank 0 only
  temporary.assign(name.begin(), name.end());
  if (writes) writes(temporary);
  result = write_pieces(temporary, pieces);
  if (!result) result = fail("rank " + std::to_string(ranks.rank()) + " cannot write '" + path.string() + "': " + result.error().message);
  result = agree(ranks, result);
  if (result && file) result = file->commit();
  file.reset();
  if (writes) writes({});
  return agree(ranks, result);
}

}  // namespace intervale
