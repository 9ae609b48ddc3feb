// Keeps a catalogue like what there is on disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/util/result.h"
#include "server/serve/catalogue.h"
#include "server/serve/file_stamp.h"

namespace intervale {

// One thread at a time. Files are read as a whole, not mapped: what happens to one later, truncation too, is no trouble to who has it.
class CatalogueWatcher {
 public:
  // Files, and folders whose *.ivm are meant (not those in folders within). While the process has more than max_memory resident, no more is read.
  explicit CatalogueWatcher(std::vector<std::filesystem::path> inputs, std::optional<std::uint64_t> max_memory = {})
      : inputs_(std::move(inputs)), max_memory_(max_memory) {}

  // What there is at the start. A file in a folder that is damaged, or has a name unfit for a data set, is logged and left out; one that is named is
  // an error, like two data sets of one name and a folder that cannot be read. keep_going is asked before each file; where it says no, what was read
  // so far is the catalogue.
  Result<Catalogue> load(const std::function<bool()>& keep_going = [] { return true; });

  // Looks into the folders again: what is served from now on, if that is something else than before. A file that is new, or another than it was, is
  // read once it is the same in two looks, so that one that is being written is left alone. Of one that is damaged, or cannot be read (which is
  // tried again in every look), what was read before stays; it is logged once. One that has gone, goes. Of two data sets of one
  // name, that of the first file in order stands.
  std::optional<Catalogue> poll();

 private:
  struct File {
    std::optional<FileStamp> stamp;      // as it was read; nothing if it was not
    Catalogue::Volume volume;            // nullptr if it could not be read
    std::optional<FileStamp> last_seen;  // in the last look
    std::string last_warning;            // said of it since it was last read
  };
  Result<void> load_folder(const std::filesystem::path& folder, const std::function<bool()>& keep_going);
  bool poll_file(const std::filesystem::path& path, File& file);
  [[nodiscard]] Catalogue catalogue() const;

  std::vector<std::filesystem::path> inputs_;
  std::optional<std::uint64_t> max_memory_;
  std::vector<std::pair<std::filesystem::path, Catalogue::Volume>> files_;  // files that were named
  std::map<std::filesystem::path, File> folder_files_;                      // in folders
  bool memory_warned_ = false;                                              // and that was said
  std::map<std::filesystem::path, bool> unreadable_folders_;                // folders, and whether that was said
};

}  // namespace intervale
