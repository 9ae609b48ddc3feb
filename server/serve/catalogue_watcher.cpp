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
struct Read {
  bool is_unread = false;  // the file could not be read; its contents may be in order
  Result<IntervalVolume> contents;
};

void log_faults(const fs::path& path, const PageFaults& faults, const IntervalVolume& volume) {
  if (faults.any()) spdlog::warn("{}: {}; {} of {} updates are not served", path.string(), to_text(faults), faults.lost_updates, volume.size());
}

// Throws NoRoom if that takes more memory than `room`. faults: as of decode_volume().
Read read(const fs::path& path, const std::string& name, const Memory& memory, std::uint64_t room, const ParallelFor& parallel, PageFaults* faults) {
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
    auto& [path, volume] = files_.emplace_back(input, load_coarse(input, nullptr, parallel));
    if (volume) continue;
    if (auto loaded = load_file(path, volume, parallel); !loaded) return tl::unexpected(loaded.error());
  }
  const ScratchMemory::Scope scope(memory_.data_memory());
  if (auto loaded = remote_.load(parallel); !loaded) return tl::unexpected(loaded.error());
  return catalogue(true);
}

// All of a named file.
Result<void> CatalogueWatcher::load_file(const fs::path& path, Catalogue::Volume& volume, const ParallelFor& parallel) {
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
  volume = counted(memory_, Memory::Holder::datasets, std::move(*loaded));
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

Result<std::optional<Catalogue>> CatalogueWatcher::complete(const ParallelFor& parallel) {
  const fs::path* path = nullptr;
  Catalogue::Volume* least = nullptr;
  File* in_folder = nullptr;  // that has it
  const auto look_at = [&](const fs::path& at, Catalogue::Volume& volume, File* file) {
    if (!volume || volume->is_whole() || (least != nullptr && (*least)->size() <= volume->size())) return;
    path = &at;
    least = &volume;
    in_folder = file;
  };
  for (auto& [at, volume] : files_) look_at(at, volume, nullptr);
  for (auto& [at, file] : folder_files_) look_at(at, file.volume, &file);
  if (auto* const remote = remote_.unfinished(); remote != nullptr && (least == nullptr || remote->volume->size() < (*least)->size())) {
    const ScratchMemory::Scope scope(memory_.data_memory());
    remote_.read_on(*remote, parallel);
    return std::optional(*catalogue(false));
  }
  if (least == nullptr) return std::nullopt;
  if (auto finer = load_coarse(*path, *least, parallel)) {
    *least = std::move(finer);
  } else if (in_folder == nullptr) {
    if (auto loaded = load_file(*path, *least, parallel); !loaded) return tl::unexpected(loaded.error());
  } else {
    least->reset();
    poll_file(*path, *in_folder, parallel);
  }
  if (*least && (*least)->is_whole()) spdlog::info("{}: all scales are loaded", path->string());
  return std::optional(*catalogue(false));
}

Result<void> CatalogueWatcher::load_folder(const fs::path& folder, const ParallelFor& parallel) {
  const auto paths = files_in(folder);
  if (!paths) return tl::unexpected(paths.error());
  for (const fs::path& path : *paths) {
    File file;
    file.last_seen = stamp_of(path);  // the first load does not wait for a second look
    if (Catalogue::check_name(path.stem().string())) file.volume = load_coarse(path, nullptr, parallel);
    if (!file.volume) poll_file(path, file, parallel);
    folder_files_[path] = std::move(file);
  }
  return {};
}

// Reads the file if it has changed and is stable. True if its contents are new.
bool CatalogueWatcher::poll_file(const fs::path& path, File& file, const ParallelFor& parallel) {
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
    return true;
  } catch (const NoRoom&) {
    file.too_little = std::max(file.too_little, room);
    return skip(path.string() + ": it takes more memory than --max-memory leaves; it is read once there is room");
  }
}

std::optional<Catalogue> CatalogueWatcher::poll(const ParallelFor& parallel) {
  bool changed = [&] {
    const ScratchMemory::Scope scope(memory_.data_memory());
    return remote_.poll(parallel);
  }();
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
      if (poll_file(path, file, parallel)) {
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

// What was read. A data set that cannot be added is an error at the start, and is skipped later.
Result<Catalogue> CatalogueWatcher::catalogue(bool is_start) const {
  auto volumes = files_;
  for (const auto& [path, file] : folder_files_) volumes.emplace_back(path, file.volume);
  for (const auto& set : remote_.all()) volumes.emplace_back(set.url.shown, set.volume);
  Catalogue catalogue;
  for (const auto& [path, volume] : volumes) {
    if (!volume) continue;
    const auto added = catalogue.add(volume);
    if (!added && is_start) return fail(added.error().message + " (" + path.string() + ")");
    if (!added) spdlog::warn("skipped: {} ({})", added.error().message, path.string());
  }
  return catalogue;
}

}  // namespace intervale
