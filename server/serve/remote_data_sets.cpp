#include "server/serve/remote_data_sets.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <optional>

#include "common/ivm/load_volume.h"
#include "common/parallel/all_cores.h"
#include "protocol/codec.h"

namespace intervale {
namespace {

std::optional<RemoteContents> as_optional(RemoteContents contents) { return contents; }

}  // namespace

RemoteDataSets::RemoteDataSets(RemoteInputs inputs, Memory& memory, bool tolerates_damage)
    : inputs_(std::move(inputs)), memory_(memory), tolerates_damage_(tolerates_damage) {
  for (const RemoteUrl& url : inputs_.urls) sets_.push_back({url, nullptr, {}, {}});
}

Result<void> RemoteDataSets::load(const ParallelFor& parallel) {
  for (DataSet& set : sets_) {
    if (auto done = read(set, inputs_.limits, parallel); !done) return tl::unexpected(done.error());
  }
  next_poll_ = std::chrono::steady_clock::now() + inputs_.poll_time;
  return {};
}

bool RemoteDataSets::poll(const ParallelFor& parallel) {
  if (sets_.empty() || std::chrono::steady_clock::now() < next_poll_) return false;
  bool changed = false;
  for (DataSet& set : sets_) changed = poll_one(set, parallel) || changed;
  next_poll_ = std::chrono::steady_clock::now() + inputs_.poll_time;
  return changed;
}

bool RemoteDataSets::poll_one(DataSet& set, const ParallelFor& parallel) {
  if (!set.stamp.is_known()) return false;
  // Folders wait meanwhile. There is another try soon.
  RemoteLimits once = inputs_.limits;
  once.attempts = 1;
  const auto changed = read(set, once, parallel);
  if (changed) {
    set.last_warning.clear();
    if (*changed) spdlog::info("{} was reloaded", set.url.shown);
    return *changed;
  }
  const std::string& why = changed.error().message;
  if (std::exchange(set.last_warning, why) != why) spdlog::warn("the data read before stays in use: {}", why);
  return false;
}

// True if there are new contents.
Result<bool> RemoteDataSets::read(DataSet& set, const RemoteLimits& given, const ParallelFor& parallel) {
  RemoteLimits limits = given;
  const std::uint64_t room = memory_.room();
  limits.most_bytes = std::min(limits.most_bytes, room);
  spdlog::debug("reads {}", set.url.shown);
  try {
    auto contents = set.stamp.is_known() ? read_remote_if_changed(set.url, inputs_.access, limits, set.stamp, parallel)
                                         : read_remote(set.url, inputs_.access, limits, parallel).map(as_optional);
    if (!contents) return tl::unexpected(contents.error());
    if (!*contents) return false;
    set.stamp = (*contents)->stamp;  // contents that are of no use are not read again, either, before they change
    PageFaults faults;
    const std::uint64_t left = room == kAnyRoom ? kAnyRoom : room - (*contents)->bytes.size();
    auto volume = decode_volume((*contents)->bytes, set.url.name, parallel, left, tolerates_damage_ ? &faults : nullptr);
    if (!volume) return fail(set.url.shown + ": " + volume.error().message);
    if (auto fits = protocol::check_sendable(volume->description()); !fits) return fail(set.url.shown + ": " + fits.error().message);
    complete_in_data_memory(*volume, memory_, parallel);
    // It includes a hash of the contents.
    if (set.volume && set.volume->description() == volume->description()) return false;
    if (faults.any()) spdlog::warn("{}: {}; {} of {} updates are not served", set.url.shown, to_text(faults), faults.lost_updates, volume->size());
    set.volume = counted(memory_, Memory::Holder::datasets, std::make_shared<const IntervalVolume>(std::move(*volume)));
    return true;
  } catch (const Stopped&) {
    throw;
  } catch (const NoRoom&) {
    return fail(set.url.shown + ": it takes more memory than --max-memory leaves");
  } catch (const std::exception& exception) {
    return fail(set.url.shown + ": cannot be read: " + exception.what());
  }
}

}  // namespace intervale
