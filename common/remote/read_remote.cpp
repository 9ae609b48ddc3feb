#include "common/remote/read_remote.h"

#include <utility>

namespace intervale {
namespace {

// nullopt: it is as known.
Result<std::optional<RemoteContents>> read_state(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits,
                                                 const RemoteStamp* known, const ParallelFor& parallel) {
  for (unsigned start = 0; start < kMostRemoteStarts; ++start) {
    RemoteFile file(url, access, limits, known);
    const auto read = file.begin(parallel).and_then([&] { return file.read_all(parallel); });
    if (read) return std::move(file).take();
    if (read.error().kind == RemoteFailure::Kind::unchanged) return std::nullopt;
    if (read.error().kind == RemoteFailure::Kind::final) return tl::unexpected(read.error().error);
  }
  return fail(url.shown + ": the file changes while it is read");
}

}  // namespace

Result<RemoteContents> read_remote(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits, const ParallelFor& parallel) {
  auto read = read_state(url, access, limits, nullptr, parallel);
  if (!read) return tl::unexpected(read.error());
  return std::move(**read);
}

Result<std::optional<RemoteContents>> read_remote_if_changed(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits,
                                                             const RemoteStamp& known, const ParallelFor& parallel) {
  return read_state(url, access, limits, &known, parallel);
}

}  // namespace intervale
