// Reads an .ivm file from a web server or an object store, in ranges, several at a time.
#pragma once

#include <optional>

#include "common/remote/remote_access.h"
#include "common/remote/remote_file.h"
#include "common/remote/remote_url.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// All bytes of the file, for decode_volume(). Its header is checked after the first 64 KiB, and nothing is allocated for
// more of a file that is no .ivm file, whose length is not as its header says, or that is larger than the limits and the
// machine's memory allow. The contents are those of one state of the file: if it changes meanwhile, reading starts again,
// twice at most. A server that knows no ranges sends all of it over one connection.
//
// Redirects are followed, five at most, and never from https to http. Credentials go to the origin of `url` only.
// Errors are one line that begins with the URL, or with that which it redirects to, without a query. Blocks; `parallel`
// may stop it within 50 ms.
[[nodiscard]] Result<RemoteContents> read_remote(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits = {},
                                                 const ParallelFor& parallel = serial);

// The same, unless the file is still as it was read: nullopt. known: of what was read; is_known().
[[nodiscard]] Result<std::optional<RemoteContents>> read_remote_if_changed(const RemoteUrl& url, const RemoteAccess& access,
                                                                           const RemoteLimits& limits, const RemoteStamp& known,
                                                                           const ParallelFor& parallel = serial);

}  // namespace intervale
