#include "common/remote/load_remote.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "common/ivm/ivm_container.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"

namespace intervale {

Result<std::shared_ptr<const IntervalVolume>> load_remote_volume(const RemoteUrl& url, const RemoteAccess& access, const ShownRanges& shown,
                                                                 const ParallelFor& parallel, PageFaults* faults) {
  if (faults == nullptr) {
    const RemoteLimits limits;
    return RemoteVolume(url, access, limits, shown).whole(parallel);
  }
  const auto contents = read_remote(url, access, {}, parallel);
  if (!contents) return tl::unexpected(contents.error());
  auto volume = decode_volume(contents->bytes, url.name, parallel, kAnyRoom, faults);
  if (!volume) return fail(url.shown + ": " + volume.error().message);
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

namespace {

// The bytes around a file's pages, or all if there is hardly anything else, or more behind them than any writer puts
// there. False: decode_summary() needs the file whole.
RemoteOutcome<bool> read_around_pages(RemoteFile& file, const RemoteLimits& limits, const ParallelFor& parallel) {
  if (auto begun = file.begin(parallel); !begun) return tl::unexpected(begun.error());
  const FileEnds start = file.ends();
  const auto pages = pages_beside_summary(start.first, start.file_bytes);
  if (!pages) return true;  // decode_summary() says what is wrong
  if (!*pages) return false;
  const std::uint64_t after = start.file_bytes - (*pages)->offset - (*pages)->bytes;
  const bool is_apart = after <= limits.range_bytes && start.first.size() <= start.file_bytes - after;
  const auto read = is_apart ? file.read((*pages)->offset, after, parallel) : file.read_all(parallel);
  if (!read) return tl::unexpected(read.error());
  return true;
}

}  // namespace

Result<std::optional<ValueSummary>> load_remote_summary(const RemoteUrl& url, const RemoteAccess& access, const ParallelFor& parallel) {
  const RemoteLimits limits;
  for (unsigned start = 0; start < kMostRemoteStarts; ++start) {
    RemoteFile file(url, access, limits);
    const auto is_there = read_around_pages(file, limits, parallel);
    if (!is_there && is_there.error().kind != RemoteFailure::Kind::changed) return tl::unexpected(is_there.error().error);
    if (!is_there) continue;
    if (!*is_there) return std::nullopt;
    auto summary = decode_summary(file.ends(), url.name);
    if (!summary) return fail(url.shown + ": " + summary.error().message);
    return *std::move(summary);
  }
  return fail(url.shown + ": the file changes while it is read");
}

Result<std::shared_ptr<const IntervalVolume>> RemoteVolume::next(const ParallelFor& parallel) { return go_on(false, parallel); }
Result<std::shared_ptr<const IntervalVolume>> RemoteVolume::whole(const ParallelFor& parallel) { return go_on(true, parallel); }

RemoteVolume::RemoteVolume(const RemoteUrl& url, const RemoteAccess& access, const RemoteLimits& limits, ShownRanges shown)
    : url_(url), access_(access), limits_(limits), shown_(std::move(shown)), file_(url, access, limits) {}

std::uint64_t RemoteVolume::file_bytes() const { return file_.ends().file_bytes; }

std::uint64_t RemoteVolume::bytes_here() const {
  const FileEnds ends = file_.ends();
  return ends.first.size() + ends.last.size();
}

// Reads all but the pages. False: that is not to be done, since the file has no bounds, or too much besides its pages.
RemoteOutcome<bool> RemoteVolume::has_bounds(const ParallelFor& parallel) {
  const FileEnds start = file_.ends();
  const auto place = [&](StreamType type) { return place_of(type, start.first, start.file_bytes, FileScope::every_range).value_or(StreamPlace()); };
  const StreamPlace pages = place(StreamType::pages);
  const std::uint64_t after = start.file_bytes - pages.offset - pages.bytes;
  if (place(StreamType::page_bounds).bytes == 0 || place(StreamType::channels).bytes != 0 || after > limits_.range_bytes) return false;
  if (start.first.size() > start.file_bytes - after) return false;  // it is there
  if (auto read = file_.read(pages.offset, after, parallel); !read) return tl::unexpected(read.error());
  return true;
}

RemoteVolume::Next RemoteVolume::read_whole(const ParallelFor& parallel) {
  if (!shown_.empty()) {
    const auto bounds = has_bounds(parallel);
    if (!bounds) return tl::unexpected(bounds.error());
    auto needed = *bounds ? needed_pages(file_.ends(), shown_) : Result<std::optional<NeededPages>>();
    if (!needed) return Result<IntervalVolume>(tl::unexpected(needed.error()));
    if (*needed) {
      if (auto read = file_.read_places((*needed)->places, parallel); !read) return tl::unexpected(read.error());
      return decode_needed_volume(file_.ends(), url_.name, (*needed)->pages, parallel);
    }
  }
  if (auto all = file_.read_all(parallel); !all) return tl::unexpected(all.error());
  return decode_volume(file_.ends().first, url_.name, parallel);
}

RemoteVolume::Next RemoteVolume::read_next(bool to_end, const ParallelFor& parallel) {
  if (!std::exchange(is_begun_, true)) {
    if (auto begun = file_.begin(parallel); !begun) return tl::unexpected(begun.error());
    if (const std::uint64_t needed = start_bytes(file_.ends().first, file_.ends().file_bytes); needed > file_.ends().first.size()) {
      if (auto read = file_.read(needed, 0, parallel); !read) return tl::unexpected(read.error());
    }
    const FileEnds start = file_.ends();
    auto scales = coarse_scales(start.first, start.file_bytes);
    if (!scales) return Result<IntervalVolume>(tl::unexpected(scales.error()));
    scales_ = *std::move(scales);
    // What comes after the pages is a few kilobytes; where it is not, all is read at once. Nor are scales of use where
    // everything is there, or nearly so.
    std::erase_if(scales_, [&](const CoarseScales& one) {
      const std::uint64_t there = std::max<std::uint64_t>(start.first.size(), one.first_bytes);
      return one.last_bytes > limits_.range_bytes || there >= start.file_bytes || one.last_bytes >= start.file_bytes - there;
    });
  }
  // Of those that are there already, the finest.
  const std::uint64_t there = file_.ends().first.size();
  while (next_ + 1 < scales_.size() && scales_[next_ + 1].first_bytes <= there) ++next_;
  if (to_end || next_ >= scales_.size()) return read_whole(parallel);
  const CoarseScales& scales = scales_[next_++];
  if (auto read = file_.read(scales.first_bytes, scales.last_bytes, parallel); !read) return tl::unexpected(read.error());
  const FileEnds ends = file_.ends();
  return decode_coarse({ends.first.first(std::size_t(scales.first_bytes)), ends.last, ends.file_bytes}, scales, url_.name, parallel);
}

Result<std::shared_ptr<const IntervalVolume>> RemoteVolume::go_on(bool to_end, const ParallelFor& parallel) {
  for (;;) {
    auto read = read_next(to_end, parallel);
    if (read && *read) return std::make_shared<const IntervalVolume>(**std::move(read));
    if (read) return fail(url_.shown + ": " + read->error().message);
    if (read.error().kind == RemoteFailure::Kind::final) return tl::unexpected(read.error().error);
    if (starts_++ == kMostRemoteStarts) return fail(url_.shown + ": the file changes while it is read");
    read_before_ += bytes_here();
    requests_before_ += file_.requests();
    file_ = RemoteFile(url_, access_, limits_);
    is_begun_ = false;
    scales_.clear();
    next_ = 0;
  }
}

}  // namespace intervale
