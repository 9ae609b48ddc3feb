#include "common/remote/load_remote.h"

#include <utility>

#include "common/ivm/load_volume.h"

namespace intervale {

Result<std::shared_ptr<const IntervalVolume>> load_remote_volume(const RemoteUrl& url, const RemoteAccess& access, const ParallelFor& parallel,
                                                                 PageFaults* faults) {
  const auto contents = read_remote(url, access, {}, parallel);
  if (!contents) return tl::unexpected(contents.error());
  auto volume = decode_volume(contents->bytes, url.name, parallel, kAnyRoom, faults);
  if (!volume) return fail(url.shown + ": " + volume.error().message);
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

}  // namespace intervale
