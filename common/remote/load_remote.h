// Data sets on web servers, as load_volume() has those in files.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/ivm/coarse_scales.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/page_faults.h"
#include "common/ivm/value_file.h"
#include "common/patch/shown_range.h"
#include "common/remote/read_remote.h"

namespace intervale {

// Reads the file, and checks it as decode_volume() does. The name is the URL's. Errors begin with the URL. shown: as of
// RemoteVolume. faults: as of decode_ivm(); then all of the file is read.
[[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> load_remote_volume(const RemoteUrl& url, const RemoteAccess& access,
                                                                               const ShownRanges& shown = {}, const ParallelFor& parallel = serial,
                                                                               PageFaults* faults = nullptr);

// decode_summary() of a file: its pages are not read. nullopt as of pages_beside_summary(). Errors begin with the URL.
[[nodiscard]] Result<std::optional<ValueSummary>> load_remote_summary(const RemoteUrl& url, const RemoteAccess& access,
                                                                      const ParallelFor& parallel = serial);

// As load_remote_volume(), from coarse to fine: a data set of every range is there as soon as its coarse scales are
// (coarse_scales.h), and of its finer ones only those pages are read that some ranges need (page_bounds.h). All others
// are read whole, and those on servers that know no ranges. One thread at a time.
class RemoteVolume {
 public:
  // What is given must outlive it. shown: the only ranges that it is for; none: all.
  RemoteVolume(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits, ShownRanges shown = {});

  // Reads on: the data set as far as the next scale, the last time IntervalVolume::is_whole(); not to be called after
  // that, or after an error. What is returned stays valid. If the file changes meanwhile, it is read from its
  // beginning: then the description has another content_hash. Errors as of load_remote_volume().
  [[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> next(const ParallelFor& parallel = serial);
  // The same for all that is left.
  [[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> whole(const ParallelFor& parallel = serial);

  [[nodiscard]] const RemoteStamp& stamp() const { return file_.stamp(); }  // of what was returned last
  [[nodiscard]] std::uint64_t file_bytes() const;                           // 0: not known yet
  [[nodiscard]] std::uint64_t read_bytes() const { return read_before_ + bytes_here(); }
  [[nodiscard]] std::uint64_t requests() const { return requests_before_ + file_.requests(); }

 private:
  using Next = RemoteOutcome<Result<IntervalVolume>>;
  [[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> go_on(bool to_end, const ParallelFor& parallel);
  [[nodiscard]] Next read_next(bool to_end, const ParallelFor& parallel);
  [[nodiscard]] Next read_whole(const ParallelFor& parallel);
  [[nodiscard]] RemoteOutcome<bool> has_bounds(const ParallelFor& parallel);
  [[nodiscard]] std::uint64_t bytes_here() const;

  const RemoteUrl& url_;
  const RemoteAccess& access_;
  const RemoteLimits& limits_;
  ShownRanges shown_;
  RemoteFile file_;
  bool is_begun_ = false;
  std::vector<CoarseScales> scales_;  // that can be had of it
  std::size_t next_ = 0;              // of those
  unsigned starts_ = 1;
  std::uint64_t read_before_ = 0, requests_before_ = 0;  // of states of the file that changed
};

}  // namespace intervale
