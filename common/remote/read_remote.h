// Reads an .ivm file from a web server or an object store, in ranges, several at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

// All bytes of the file, for decode_volume(). Its header is checked after the first 64 KiB, and nothing is allocated for
// more of a file that is no .ivm file, whose length is not as its header says, or that is larger than the limits and the
// machine's memory allow. The contents are those of one state of the file: if it changes meanwhile, reading starts again,
// twice at most. A server that knows no ranges sends all of it over one connection.
//
// Redirects are followed, five at most, and never from https to http. Credentials go to the origin of `url` only.
// Errors are one line that begins with the URL, or with that which it redirects to, without a query. Blocks; `parallel` may stop it within 50 ms.
[[nodiscard]] Result<RemoteContents> read_remote(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits = {},
                                                 const ParallelFor& parallel = serial);

// The same, unless the file is still as it was read: nullopt. known: of what was read; is_known().
[[nodiscard]] Result<std::optional<RemoteContents>> read_remote_if_changed(const RemoteUrl& url, const RemoteAccess& access,
                                                                           const RemoteLimits& limits, const RemoteStamp& known,
                                                                           const ParallelFor& parallel = serial);

}  // namespace intervale
