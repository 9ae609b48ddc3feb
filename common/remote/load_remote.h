// Data sets on web servers, as load_volume() has those in files.
#pragma once

#include <memory>

#include "common/ivm/interval_volume.h"
#include "common/ivm/page_faults.h"
#include "common/remote/read_remote.h"

namespace intervale {

// Reads the file, and checks it as decode_volume() does. The name is the URL's. Errors begin with the URL. faults: as of
// decode_ivm().
[[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> load_remote_volume(const RemoteUrl& url, const RemoteAccess& access,
                                                                               const ParallelFor& parallel = serial, PageFaults* faults = nullptr);

}  // namespace intervale
