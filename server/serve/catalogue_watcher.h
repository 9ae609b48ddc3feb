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
#include "server/serve/data_set_source.h"
#include "server/serve/file_stamp.h"
#include "server/serve/memory.h"
#include "server/serve/scale_demand.h"

namespace intervale {

// Files are read into memory, not mapped: changes to a file, such as truncation, do not affect sessions that use its
// data set.
class CatalogueWatcher : public DataSetSource {
 public:
  // inputs: files, and folders of *.ivm files (without their subfolders). memory: counts the data sets, and must outlive
  // them; if it has data memory, they lie there; files of folders that would take more than its room are not read until
  // there is more. tolerates_damage: files with damaged pages are served without what these hold (page_faults.h), which
  // is logged. demand: whom finer scales of large files are read for; it must outlive this; nullptr: they are read
  // anyway.
  CatalogueWatcher(std::vector<std::filesystem::path> inputs, Memory& memory, bool tolerates_damage = false, ScaleDemand* demand = nullptr)
      : inputs_(std::move(inputs)), memory_(memory), tolerates_damage_(tolerates_damage), demand_(demand) {}

  // A file in a folder that is damaged, or whose name is invalid or taken, is logged and skipped. A named file with such
  // a fault is an error; so is a folder that cannot be read.
  Result<Catalogue> load(const ParallelFor& parallel = serial) override;

  // A named file that turns out to be damaged is an error; such a file in a folder is logged, and leaves the catalogue.
  // On demand, what cannot be read is logged, and refused; what is there stays.
  Result<std::optional<Catalogue>> complete(const ParallelFor& parallel = serial) override;

  std::optional<Catalogue> drop_unused(ScaleDemand::Clock::duration time) override;

  // Reads the folders again. A new or changed file is loaded, on demand its coarse scales, once it is the same in two
  // consecutive polls, so that no file is read while it is written. If a file is damaged or cannot be read, which is
  // logged once, its last good contents stay; a file that cannot be read is tried again in every poll. A file that was
  // removed leaves the catalogue. Of two data sets of one name, the one whose file comes first counts.
  std::optional<Catalogue> poll(const ParallelFor& parallel = serial) override;

 private:
  // The contents of a file. nullptr: there are none.
  struct Contents {
    Catalogue::Volume volume;
    Catalogue::Volume coarse;  // on demand, its coarsest scales, where these were read first
    std::string last_warning;  // logged since it was last read, not to be repeated
  };
  struct File : Contents {               // the last good contents
    std::optional<FileStamp> stamp;      // when it was last read; nullopt: never
    std::optional<FileStamp> last_seen;  // in the last poll
    std::uint64_t too_little = 0;        // in so little room it was not read
  };
  [[nodiscard]] bool is_wanted(const Catalogue::Volume& volume) const;
  void read_on_demand(const std::filesystem::path& path, Contents& contents, bool is_in_folder, const ParallelFor& parallel);
  Result<void> load_file(const std::filesystem::path& path, Contents& contents, const ParallelFor& parallel);
  Result<void> load_folder(const std::filesystem::path& folder, const ParallelFor& parallel);
  [[nodiscard]] Catalogue::Volume load_coarse(const std::filesystem::path& path, const Catalogue::Volume& held, const ParallelFor& parallel);
  enum class Read { what_is_served_first, all };
  bool poll_file(const std::filesystem::path& path, File& file, Read read, const ParallelFor& parallel);
  [[nodiscard]] Result<Catalogue> catalogue(bool is_start);

  std::vector<std::filesystem::path> inputs_;
  Memory& memory_;
  bool tolerates_damage_;
  ScaleDemand* demand_;
  std::vector<std::pair<std::filesystem::path, Contents>> files_;  // named as inputs
  std::map<std::filesystem::path, File> folder_files_;             // in folders
  std::set<std::filesystem::path> unreadable_folders_, skipped_;   // that were logged; skipped_: files
};

}  // namespace intervale
