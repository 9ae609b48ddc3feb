#include "server/serve/catalogue_watcher.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <system_error>

#include "common/ivm/coarse_scales.h"
#include "common/ivm/load_volume.h"
#include "common/parallel/all_cores.h"
#include "protocol/codec.h"
#include "server/scratch/scratch_memory.h"

namespace intervale {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLargeFile = 1 << 20;  // takes some 0.1 s to decode

Result<std::vector<fs::path>> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (at->path().extension() == ".ivm" && at->is_regular_file(ignored)) files.push_back(at->path());
  }
  if (error) return fail("cannot read the folder " + folder.string() + ": " + error.message());
  std::sort(files.begin(), files.end());  // directory_iterator's order is unspecified; the log's is not
  return files;
}

// A file that needs more memory than the system has (std::bad_alloc) is an error, and does not end the server. NoRoom is
// for the caller: there may be room later. before: what the error begins with.
template <class Function>
auto catching(const std::string& before, const Function& function) -> decltype(function()) {
  try {
    return function();
  } catch (const Stopped&) {
    throw;
  } catch (const NoRoom&) {
    throw;
  } catch (const std::exception& exception) {
    return fail(before + "cannot be read: " + exception.what());
  }
}

// A file of a folder.
struct FileRead {
  bool is_unread = false;  // the file could not be read; its contents may be in order
  Result<IntervalVolume> contents;
};

void log_faults(const fs::path& path, const PageFaults& faults, const IntervalVolume& volume) {
  if (faults.any()) spdlog::warn("{}: {}; {} of {} updates are not served", path.string(), to_text(faults), faults.lost_updates, volume.size());
}

// Throws NoRoom if that takes more memory than `room`. faults: as of decode_volume().
FileRead read(const fs::path& path, const std::string& name, const Memory& memory, std::uint64_t room, const ParallelFor& parallel,
              PageFaults* faults) {
  spdlog::debug("reads {}", path.string());
  std::error_code ignored;
  if (const auto size = fs::file_size(path, ignored); !ignored && size > room) throw NoRoom();
  const auto bytes = catching(path.string() + ": ", [&] { return read_volume_file(path, parallel); });
  if (!bytes) return {true, tl::unexpected(bytes.error())};
  auto volume = catching("", [&] {
    auto decoded = decode_volume(*bytes, name, parallel, room - std::min<std::uint64_t>(room, bytes->size()), faults);
    if (decoded) complete_in_data_memory(*decoded, memory, parallel);
    return decoded;
  });
  if (!volume) return {false, std::move(volume)};
  if (auto fits = protocol::check_sendable(volume->description()); !fits) return {false, tl::unexpected(fits.error())};
  return {false, std::move(volume)};
}

}  // namespace

Result<Catalogue> CatalogueWatcher::load(const ParallelFor& parallel) {
  for (const fs::path& input : inputs_) {
    std::error_code ignored;
    if (fs::is_directory(input, ignored)) {
      if (auto loaded = load_folder(input, parallel); !loaded) return tl::unexpected(loaded.error());
      continue;
    }
    const auto coarse = load_coarse(input, nullptr, parallel);
    auto& [path, contents] = files_.emplace_back(input, Contents{coarse, demand_ != nullptr ? coarse : nullptr, {}});
    if (coarse) continue;
    if (auto loaded = load_file(path, contents, parallel); !loaded) return tl::unexpected(loaded.error());
  }
  return catalogue(true);
}

// All of a named file.
Result<void> CatalogueWatcher::load_file(const fs::path& path, Contents& contents, const ParallelFor& parallel) {
  spdlog::debug("reads {}", path.string());
  const ScratchMemory::Scope scope(memory_.data_memory());
  PageFaults faults;
  auto loaded = catching(path.string() + ": ", [&] {
    auto read = load_volume(path, parallel, tolerates_damage_ ? &faults : nullptr);
    if (read) complete_in_data_memory(**read, memory_, parallel);
    return read;
  });
  if (!loaded) return tl::unexpected(loaded.error());
  log_faults(path, faults, **loaded);
  contents.volume = counted(memory_, Memory::Holder::datasets, std::move(*loaded));
  return {};
}

// The coarsest scales of a large file that are finer than those held; the first ones lie in memory. nullptr: it is to be
// read whole, which also tells what is wrong with it.
Catalogue::Volume CatalogueWatcher::load_coarse(const fs::path& path, const Catalogue::Volume& held, const ParallelFor& parallel) {
  if (tolerates_damage_ || memory_.room() != ~std::uint64_t(0)) return nullptr;
  std::error_code ignored;
  if (const auto size = fs::file_size(path, ignored); ignored || size < kLargeFile) return nullptr;
  const ScratchMemory::Scope scope(held ? memory_.data_memory() : nullptr);
  auto volume = catching("", [&] { return load_coarse_volume(path, held.get(), parallel); });
  if (!volume || *volume == nullptr || !protocol::check_sendable((*volume)->description())) return nullptr;
  if (held && (*volume)->description() != held->description()) return nullptr;  // the file has changed
  return counted(memory_, Memory::Holder::datasets, std::move(*volume));
}

// Whether it is to be read on.
bool CatalogueWatcher::is_wanted(const Catalogue::Volume& volume) const {
  return volume && !volume->is_whole() && (demand_ == nullptr || demand_->is_wanted(*volume));
}

Result<std::optional<Catalogue>> CatalogueWatcher::complete(const ParallelFor& parallel) {
  const fs::path* path = nullptr;
  Contents* least = nullptr;
  File* in_folder = nullptr;  // that has it
  const auto look_at = [&](const fs::path& at, Contents& contents, File* file) {
    if (!is_wanted(contents.volume) || (least != nullptr && least->volume->size() <= contents.volume->size())) return;
    path = &at;
    least = &contents;
    in_folder = file;
  };
  for (auto& [at, contents] : files_) look_at(at, contents, nullptr);
  for (auto& [at, file] : folder_files_) look_at(at, file, &file);
  if (least == nullptr) return std::nullopt;
  if (auto finer = load_coarse(*path, least->volume, parallel)) {
    least->volume = std::move(finer);
    least->last_warning.clear();
  } else if (demand_ != nullptr) {
    read_on_demand(*path, *least, in_folder != nullptr, parallel);
  } else if (in_folder == nullptr) {
    if (auto loaded = load_file(*path, *least, parallel); !loaded) return tl::unexpected(loaded.error());
  } else {
    least->volume.reset();
    in_folder->stamp.reset();
    poll_file(*path, *in_folder, Read::all, parallel);
  }
  if (least->volume && least->volume->is_whole()) spdlog::info("{}: all scales are loaded", path->string());
  return std::optional(*catalogue(false));
}

// All of a file whose coarse scales are there. If that fails, they stay. If it is another file, its contents take their
// place; those of one in a folder with the next polls.
void CatalogueWatcher::read_on_demand(const fs::path& path, Contents& contents, bool is_in_folder, const ParallelFor& parallel) {
  const Catalogue::Volume before = contents.volume;
  const auto loaded = load_file(path, contents, parallel);
  const bool is_other = loaded && contents.volume->description() != before->description();
  if (loaded && !is_other) return contents.last_warning.clear();
  if (is_other && !is_in_folder) {
    contents.coarse = load_coarse(path, nullptr, parallel);
    return;
  }
  contents.volume = before;
  demand_->refuse(*before);
  const std::string why = is_other ? path.string() + ": it has changed" : loaded.error().message;
  if (std::exchange(contents.last_warning, why) != why) spdlog::warn("the coarse scales read before stay in use: {}", why);
}

std::optional<Catalogue> CatalogueWatcher::drop_unused(ScaleDemand::Clock::duration time) {
  if (demand_ == nullptr) return {};
  bool has_dropped = false;
  const auto look_at = [&](const fs::path& path, Contents& contents) {
    if (!contents.coarse || !contents.volume || contents.volume == contents.coarse) return;
    if (contents.volume->description() != contents.coarse->description()) return;
    if (!demand_->is_idle(path.stem().string(), time)) return;
    contents.volume = contents.coarse;
    has_dropped = true;
    spdlog::info("{}: finer scales are dropped, as no session uses them", path.string());
  };
  for (auto& [path, contents] : files_) look_at(path, contents);
  for (auto& [path, file] : folder_files_) look_at(path, file);
  if (!has_dropped) return {};
  return *catalogue(false);
}

Result<void> CatalogueWatcher::load_folder(const fs::path& folder, const ParallelFor& parallel) {
  const auto paths = files_in(folder);
  if (!paths) return tl::unexpected(paths.error());
  for (const fs::path& path : *paths) {
    File file;
    file.last_seen = stamp_of(path);  // the first load does not wait for a second look
    if (Catalogue::check_name(path.stem().string())) file.volume = load_coarse(path, nullptr, parallel);
    if (!file.volume) {
      poll_file(path, file, Read::all, parallel);
    } else {
      file.stamp = file.last_seen;
      if (demand_ != nullptr) file.coarse = file.volume;
    }
    folder_files_[path] = std::move(file);
  }
  return {};
}

// Reads the file if it has changed and is stable. True if its contents are new.
bool CatalogueWatcher::poll_file(const fs::path& path, File& file, Read what, const ParallelFor& parallel) {
  // Before reading: a write during the read then counts as a change.
  const auto stamp = stamp_of(path);
  const bool is_stable = stamp == std::exchange(file.last_seen, stamp);
  if (!is_stable) file.too_little = 0;
  if (!stamp || stamp == file.stamp || !is_stable) return false;
  const auto skip = [&file](const std::string& why) {
    if (std::exchange(file.last_warning, why) != why) spdlog::warn("{}: {}", file.volume ? "the data read before stays in use" : "skipped", why);
    return false;
  };
  const std::string name = path.stem().string();
  if (auto fit = Catalogue::check_name(name); !fit) return skip(path.string() + ": " + fit.error().message);
  if (demand_ != nullptr && what == Read::what_is_served_first) {
    if (auto coarse = load_coarse(path, nullptr, parallel)) {
      file.stamp = stamp;
      file.last_warning.clear();
      if (file.volume && file.volume->description() == coarse->description()) return false;
      file.volume = file.coarse = std::move(coarse);
      return true;
    }
  }
  const std::uint64_t room = memory_.room();
  try {
    if (room <= file.too_little) throw NoRoom();
    const ScratchMemory::Scope scope(memory_.data_memory());
    PageFaults faults;
    auto volume = read(path, name, memory_, room, parallel, tolerates_damage_ ? &faults : nullptr);
    file.too_little = 0;
    // Not the file's fault, perhaps: out of descriptors, or no permission; tried again even if the file stays as it is.
    if (volume.is_unread) return skip(volume.contents.error().message);
    file.stamp = stamp;
    file.last_warning.clear();
    if (!volume.contents) return skip(path.string() + ": " + volume.contents.error().message);
    // It includes a hash of the contents.
    if (file.volume && file.volume->description() == volume.contents->description()) return false;
    log_faults(path, faults, *volume.contents);
    file.volume = counted(memory_, Memory::Holder::datasets, std::make_shared<const IntervalVolume>(std::move(*volume.contents)));
    if (file.coarse && file.coarse->description() != file.volume->description()) file.coarse.reset();
    return true;
  } catch (const NoRoom&) {
    file.too_little = std::max(file.too_little, room);
    return skip(path.string() + ": it takes more memory than --max-memory leaves; it is read once there is room");
  }
}

std::optional<Catalogue> CatalogueWatcher::poll(const ParallelFor& parallel) {
  bool changed = false;
  std::map<fs::path, File> found;
  for (const fs::path& input : inputs_) {
    const bool is_file = std::any_of(files_.begin(), files_.end(), [&input](const auto& named) { return named.first == input; });
    if (is_file) continue;
    const auto paths = files_in(input);
    if (!paths) {
      // The folder may be back soon: its data sets stay.
      if (unreadable_folders_.insert(input).second) spdlog::warn("{}; the data read before stays in use", paths.error().message);
      const fs::path folder = (input / "file").parent_path();  // without a slash at its end
      for (const auto& [path, file] : folder_files_) {
        if (path.parent_path() == folder) found[path] = file;
      }
      continue;
    }
    unreadable_folders_.erase(input);
    for (const fs::path& path : *paths) {
      const auto known = folder_files_.find(path);
      File file = known == folder_files_.end() ? File() : known->second;
      const bool was_known = file.volume != nullptr;
      if (poll_file(path, file, Read::what_is_served_first, parallel)) {
        changed = true;
        spdlog::info("{} {}", path.string(), was_known ? "was reloaded" : "was loaded");
      }
      found[path] = std::move(file);
    }
  }
  for (const auto& [path, file] : folder_files_) {
    if (found.contains(path) || !file.volume) continue;
    changed = true;
    spdlog::info("{} was removed", path.string());
  }
  folder_files_ = std::move(found);
  if (!changed) return {};
  return *catalogue(false);
}

// What was read. A named data set that cannot be added is an error at the start; others are skipped.
Result<Catalogue> CatalogueWatcher::catalogue(bool is_start) {
  Catalogue catalogue;
  const auto add = [&](const fs::path& path, const Contents& contents) {
    auto added = contents.volume ? catalogue.add(contents.volume) : Result<void>();
    return added.map_error([&](const Error& error) { return Error{error.message + " (" + path.string() + ")"}; });
  };
  const auto skip = [&](const fs::path& path, const Result<void>& added) {
    if (added) {
      skipped_.erase(path);
    } else if (skipped_.insert(path).second) {
      spdlog::warn("skipped: {}", added.error().message);
    }
  };
  for (const auto& [path, contents] : files_) {
    auto added = add(path, contents);
    if (!added && is_start) return tl::unexpected(added.error());
    skip(path, added);
  }
  for (const auto& [path, file] : folder_files_) skip(path, add(path, file));
  return catalogue;
}

}  // namespace intervale
