// A file on a web server or an object store, read in ranges, several at a time, as far as it is wanted.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/ivm_container.h"
#include "common/remote/remote_access.h"
#include "common/remote/remote_url.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

struct RemoteLimits {
  std::uint64_t most_bytes = ~std::uint64_t(0);    // of the file; a larger one is refused before anything is allocated for it
  std::size_t connections = 6;                     // at a time
  std::uint64_t range_bytes = 4 << 20;             // of one request
  unsigned attempts = 6;                           // of one request, while it fails for a reason that may pass; at least 1
  std::chrono::milliseconds first_pause{250};      // before the second attempt; doubles with each, less up to a half at random
  std::chrono::seconds most_pause{30};             // also of what a server asks for by Retry-After: if it asks for more, reading fails
  std::chrono::milliseconds connect_time{10'000};  // to resolve, to connect, and for the handshake of TLS
  std::chrono::seconds idle_time{30};              // in which less than 1 kB a second arrives; then the attempt has failed
};

// Which contents a file has. Two that are equal, and is_known(), are of the same contents.
struct RemoteStamp {
  std::string etag, last_modified;  // as the server sends them; empty: it does not
  std::uint64_t bytes = 0;
  [[nodiscard]] bool is_known() const { return !etag.empty() || !last_modified.empty(); }
  friend bool operator==(const RemoteStamp&, const RemoteStamp&) = default;
};

struct RemoteContents {
  std::vector<std::byte> bytes;
  RemoteStamp stamp;
};

// Why reading did not go on.
struct RemoteFailure {
  enum class Kind { final, changed, unchanged } kind = Kind::final;  // changed: since it began. unchanged: since `known`
  Error error = {};                                                  // if final: one line that begins with the URL
};
template <class T>
using RemoteOutcome = tl::expected<T, RemoteFailure>;

// If the file changes while it is read, so often read_remote() and RemoteVolume read it from its beginning, and then fail.
inline constexpr unsigned kMostRemoteStarts = 3;

// One state of a file: what its first range is of. After a failure it cannot be used any more. Requests, limits, and what
// is checked of the file's beginning: as read_remote.h says. No byte is asked for twice but where a request failed. One
// thread at a time; those who wait block, and `parallel` may stop them within 50 ms.
class RemoteFile {
 public:
  // What is given must outlive it. known: of what was read before; nullptr: nothing was.
  RemoteFile(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits, const RemoteStamp* known = nullptr);
  RemoteFile(RemoteFile&&) noexcept;
  RemoteFile& operator=(RemoteFile&&) noexcept;
  ~RemoteFile();

  // First: reads the file's first 64 KiB, or all of it from a server that knows no ranges.
  [[nodiscard]] RemoteOutcome<void> begin(const ParallelFor& parallel);
  // Then: until so many bytes at both ends are there. last_bytes: 0, or the same with each call.
  [[nodiscard]] RemoteOutcome<void> read(std::uint64_t first_bytes, std::uint64_t last_bytes, const ParallelFor& parallel);
  // Then, and last: these places, ascending and none of them there. Their bytes follow the first ones, in order.
  [[nodiscard]] RemoteOutcome<void> read_places(std::span<const StreamPlace> places, const ParallelFor& parallel);
  // Until all of it is there, as the first bytes; not after read_places().
  [[nodiscard]] RemoteOutcome<void> read_all(const ParallelFor& parallel);

  // What is there; valid until the next call.
  [[nodiscard]] FileEnds ends() const;
  [[nodiscard]] const RemoteStamp& stamp() const;  // after begin()
  [[nodiscard]] std::uint64_t requests() const;    // made by now, failed ones and redirects included
  // The first bytes; after read_all().
  [[nodiscard]] RemoteContents take() &&;

 private:
  class Reader;
  std::unique_ptr<Reader> reader_;
};

}  // namespace intervale
