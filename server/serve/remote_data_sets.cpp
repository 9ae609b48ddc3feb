#include "server/serve/remote_data_sets.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <optional>

#include "common/ivm/load_volume.h"
#include "common/parallel/all_cores.h"
#include "protocol/codec.h"
#include "server/scratch/scratch_memory.h"

namespace intervale {
namespace {

std::optional<RemoteContents> as_optional(RemoteContents contents) { return contents; }

// What prevents reading is an error that begins with the URL.
template <class Read>
auto catching(const RemoteUrl& url, const Read& read) -> decltype(read()) {
  try {
    return read();
  } catch (const Stopped&) {
    throw;
  } catch (const NoRoom&) {
    return fail(url.shown + ": it takes more memory than --max-memory leaves");
  } catch (const std::exception& exception) {
    return fail(url.shown + ": cannot be read: " + exception.what());
  }
}

}  // namespace

RemoteDataSets::RemoteDataSets(RemoteInputs inputs, Memory& memory, bool tolerates_damage, ScaleDemand* demand)
    : inputs_(std::move(inputs)), memory_(memory), tolerates_damage_(tolerates_damage), demand_(demand) {
  for (const RemoteUrl& url : inputs_.urls) sets_.push_back({url, nullptr, {}, {}});
  once_ = inputs_.limits;
  once_.attempts = 1;
}

void RemoteDataSets::warn(DataSet& set, const std::string& why) {
  if (std::exchange(set.last_warning, why) != why) spdlog::warn("the data read before stays in use: {}", why);
}

Catalogue RemoteDataSets::catalogue() const {
  Catalogue catalogue;
  for (const DataSet& set : sets_) (void)catalogue.add(set.volume);  // as at the start
  return catalogue;
}

// From the coarsest scales on.
void RemoteDataSets::begin(DataSet& set) {
  set.rest = std::make_unique<RemoteVolume>(set.url, inputs_.access, demand_ != nullptr && set.volume ? once_ : inputs_.limits);
}

Result<Catalogue> RemoteDataSets::load(const ParallelFor& parallel) {
  const ScratchMemory::Scope scope(memory_.data_memory());
  Catalogue catalogue;
  for (DataSet& set : sets_) {
    if (memory_.room() == kAnyRoom && !tolerates_damage_) {
      begin(set);
      if (auto done = read_next(set, parallel); !done) return tl::unexpected(done.error());
    } else if (auto done = read(set, inputs_.limits, parallel); !done) {
      return tl::unexpected(done.error());
    }
    if (auto added = catalogue.add(set.volume); !added) return fail(added.error().message + " (" + set.url.shown + ")");
  }
  next_poll_ = std::chrono::steady_clock::now() + inputs_.poll_time;
  return catalogue;
}

Result<std::optional<Catalogue>> RemoteDataSets::complete(const ParallelFor& parallel) {
  DataSet* least = nullptr;
  for (DataSet& set : sets_) {
    if (!set.rest || (demand_ != nullptr && !demand_->is_wanted(*set.volume))) continue;
    if (least == nullptr || set.volume->size() < least->volume->size()) least = &set;
  }
  if (least == nullptr) return std::nullopt;
  const ScratchMemory::Scope scope(memory_.data_memory());
  read_on(*least, parallel);
  return std::optional(catalogue());
}

void RemoteDataSets::read_on(DataSet& set, const ParallelFor& parallel) {
  if (auto done = read_next(set, parallel); !done) {
    set.rest.reset();
    if (demand_ != nullptr) {
      demand_->refuse(*set.volume);
      begin(set);
    } else {
      set.stamp = {};
    }
    return warn(set, done.error().message);
  }
  set.last_warning.clear();
  if (!set.rest) spdlog::info("{}: all scales are loaded", set.url.shown);
}

Result<void> RemoteDataSets::read_next(DataSet& set, const ParallelFor& parallel) {
  return catching(set.url, [&]() -> Result<void> {
    const auto volume = set.rest->next(parallel);
    if (!volume) return tl::unexpected(volume.error());
    if (auto fits = protocol::check_sendable((*volume)->description()); !fits) return fail(set.url.shown + ": " + fits.error().message);
    set.stamp = set.rest->stamp();
    if ((*volume)->is_whole()) {
      set.rest.reset();
      complete_in_data_memory(**volume, memory_, parallel);
    }
    // Less, if it was begun again.
    const bool is_less = set.volume && set.volume->description() == (*volume)->description() && (*volume)->size() < set.volume->size();
    if (!is_less) set.volume = counted(memory_, Memory::Holder::datasets, *volume);
    if (set.coarse && set.coarse->description() != set.volume->description()) set.coarse.reset();  // it has changed
    if (demand_ != nullptr && !set.coarse && !set.volume->is_whole()) set.coarse = set.volume;
    return {};
  });
}

std::optional<Catalogue> RemoteDataSets::drop_unused(ScaleDemand::Clock::duration time) {
  if (demand_ == nullptr) return {};
  bool has_dropped = false;
  for (DataSet& set : sets_) {
    if (!set.coarse || set.volume->size() <= set.coarse->size() || !demand_->is_idle(set.url.name, time)) continue;
    set.volume = set.coarse;
    begin(set);
    has_dropped = true;
    spdlog::info("{}: finer scales are dropped, as no session uses them", set.url.shown);
  }
  if (!has_dropped) return {};
  return catalogue();
}

std::optional<Catalogue> RemoteDataSets::poll(const ParallelFor& parallel) {
  if (sets_.empty() || std::chrono::steady_clock::now() < next_poll_) return {};
  const ScratchMemory::Scope scope(memory_.data_memory());
  bool changed = false;
  for (DataSet& set : sets_) changed = poll_one(set, parallel) || changed;
  next_poll_ = std::chrono::steady_clock::now() + inputs_.poll_time;
  if (!changed) return {};
  return catalogue();
}

bool RemoteDataSets::poll_one(DataSet& set, const ParallelFor& parallel) {
  if (!set.stamp.is_known() && (set.volume->is_whole() || set.rest)) return false;
  const auto changed = demand_ != nullptr ? read_if_changed(set, parallel) : read(set, once_, parallel);
  if (!changed) {
    warn(set, changed.error().message);
    return false;
  }
  set.last_warning.clear();
  if (*changed) spdlog::info("{} was reloaded", set.url.shown);
  return *changed;
}

// On demand: the coarse scales.
Result<bool> RemoteDataSets::read_if_changed(DataSet& set, const ParallelFor& parallel) {
  RemoteFile file(set.url, inputs_.access, once_, &set.stamp);
  const auto begun = file.begin(parallel);
  if (!begun && begun.error().kind == RemoteFailure::Kind::unchanged) return false;
  if (!begun && begun.error().kind == RemoteFailure::Kind::final) return tl::unexpected(begun.error().error);
  const Catalogue::Volume before = set.volume;
  begin(set);
  if (auto done = read_next(set, parallel); !done) {
    begin(set);
    return tl::unexpected(done.error());
  }
  return set.volume != before;
}

// True if there are new contents.
Result<bool> RemoteDataSets::read(DataSet& set, const RemoteLimits& given, const ParallelFor& parallel) {
  RemoteLimits limits = given;
  const std::uint64_t room = memory_.room();
  limits.most_bytes = std::min(limits.most_bytes, room);
  spdlog::debug("reads {}", set.url.shown);
  return catching(set.url, [&]() -> Result<bool> {
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
    if (set.volume && set.volume->is_whole() && set.volume->description() == volume->description()) return false;
    if (faults.any()) spdlog::warn("{}: {}; {} of {} updates are not served", set.url.shown, to_text(faults), faults.lost_updates, volume->size());
    set.volume = counted(memory_, Memory::Holder::datasets, std::make_shared<const IntervalVolume>(std::move(*volume)));
    set.rest.reset();
    if (set.coarse && set.coarse->description() != set.volume->description()) set.coarse.reset();
    return true;
  });
}

}  // namespace intervale
