// Loads the data sets that a server offers, and follows the changes in their folders.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/util/parallel.h"
#include "common/util/result.h"
#include "server/serve/catalogue.h"
#include "server/serve/file_stamp.h"
#include "server/serve/memory.h"
#include "server/serve/remote_data_sets.h"
#include "server/serve/scale_demand.h"

namespace intervale {

// One thread at a time. Files are read into memory, not mapped: changes to a file, such as truncation, do not affect
// sessions that use its data set.
class CatalogueWatcher {
 public:
  // inputs: files, and folders of *.ivm files (without their subfolders). memory: counts the data sets, and must outlive
  // them; if it has data memory, they lie there; files of folders that would take more than its room are not read until
  // there is more. tolerates_damage: files with damaged pages are served without what these hold (page_faults.h), which
  // is logged. remote: files on web servers. demand: whom finer scales of large files are read for; it must outlive
  // this; nullptr: they are read anyway.
  CatalogueWatcher(std::vector<std::filesystem::path> inputs, Memory& memory, bool tolerates_damage = false, RemoteInputs remote = {},
                   ScaleDemand* demand = nullptr)
      : inputs_(std::move(inputs)),
        memory_(memory),
        tolerates_damage_(tolerates_damage),
        demand_(demand),
        remote_(std::move(remote), memory, tolerates_damage, demand) {}

  // The catalogue at the start. A file in a folder that is damaged, or whose name is invalid, is logged and skipped.
  // A named file or URL with such a fault is an error; so are two data sets of one name, and a folder that cannot be read.
  // `parallel` may stop load(), complete() and poll(): they throw what it throws. Of large files of every range, only the
  // coarse scales are in it (coarse_scales.h).
  Result<Catalogue> load(const ParallelFor& parallel = serial);

  // After load(): reads on, of the data set that has fewest updates of those that are not whole and of which more is
  // wanted: as far as the next scale, at last all of it. Returns the new catalogue; nullopt once nothing more is
  // wanted. A named file that turns out to be damaged is an error; such a file in a folder is logged, and leaves the
  // catalogue. What is wrong with a URL then is logged. On demand, what cannot be read is logged, and refused; what is
  // there stays.
  Result<std::optional<Catalogue>> complete(const ParallelFor& parallel = serial);

  // On demand: drops the finer scales of data sets that no session has used for so long. Returns the new catalogue, or
  // nullopt if there were none.
  std::optional<Catalogue> drop_unused(ScaleDemand::Clock::duration time);

  // Reads the folders again. Returns the new catalogue, or nullopt if nothing changed. A new or changed file is
  // loaded once it is the same in two consecutive polls, so that no file is read while it is written. If a file is
  // damaged or cannot be read, which is logged once, its last good contents stay; a file that cannot be read is tried
  // again in every poll. A file that was removed leaves the catalogue. Of two data sets of one name, the one whose
  // file comes first counts, and URLs come last.
  std::optional<Catalogue> poll(const ParallelFor& parallel = serial);

 private:
  // The contents of a file. nullptr: there are none.
  struct Contents {
    Catalogue::Volume volume;
    Catalogue::Volume coarse;  // on demand, its coarsest scales, where these were read first
  };
  struct File : Contents {               // the last good contents
    std::optional<FileStamp> stamp;      // when it was last read; nullopt: never
    std::optional<FileStamp> last_seen;  // in the last poll
    std::string last_warning;            // logged since it was last read, not to be repeated
    std::uint64_t too_little = 0;        // in so little room it was not read
  };
  [[nodiscard]] bool is_wanted(const std::string& name, const Catalogue::Volume& volume) const;
  Result<void> load_file(const std::filesystem::path& path, Contents& contents, const ParallelFor& parallel);
  Result<void> load_folder(const std::filesystem::path& folder, const ParallelFor& parallel);
  [[nodiscard]] Catalogue::Volume load_coarse(const std::filesystem::path& path, const Catalogue::Volume& held, const ParallelFor& parallel);
  enum class Read { what_is_served_first, all };
  bool poll_file(const std::filesystem::path& path, File& file, Read read, const ParallelFor& parallel);
  [[nodiscard]] Result<Catalogue> catalogue(bool is_start) const;

  std::vector<std::filesystem::path> inputs_;
  Memory& memory_;
  bool tolerates_damage_;
  ScaleDemand* demand_;
  std::vector<std::pair<std::filesystem::path, Contents>> files_;  // named as inputs
  std::map<std::filesystem::path, File> folder_files_;             // in folders
  std::set<std::filesystem::path> unreadable_folders_;             // that were logged
  RemoteDataSets remote_;
};

}  // namespace intervale
