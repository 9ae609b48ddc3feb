#include "server/cluster/shared_file.h"

#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <memory>
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

Result<void> write_shared_file(Ranks& ranks, const std::filesystem::path& path, std::span<const SharedPiece> pieces, const LastPieces& last,
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
  const auto write = [&](std::span<const SharedPiece> some) -> Result<void> {
    auto written = write_pieces(temporary, some);
    if (!written) return fail("rank " + std::to_string(ranks.rank()) + " cannot write '" + path.string() + "': " + written.error().message);
    return written;
  };
  result = agree(ranks, write(pieces));
  if (result && file) result = last(temporary).and_then(write);
  if (result && file) result = file->commit();
  file.reset();
  if (writes) writes({});
  return agree(ranks, result);
}

Result<std::uint64_t> checksum_of(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t bytes) {
  std::ifstream in(file, std::ios::binary);
  in.seekg(std::streamoff(offset));
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_64bits_reset(state.get());
  std::vector<char> chunk(std::min<std::uint64_t>(bytes, 1 << 20));
  while (bytes > 0) {
    const auto some = std::min<std::uint64_t>(bytes, chunk.size());
    if (!in.read(chunk.data(), std::streamsize(some))) return fail("cannot read '" + file.string() + "'");
    XXH3_64bits_update(state.get(), chunk.data(), some);
    bytes -= some;
  }
  return XXH3_64bits_digest(state.get());
}

}  // namespace intervale
