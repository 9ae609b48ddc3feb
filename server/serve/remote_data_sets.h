// The data sets of a server that are files on web servers.
#pragma once

#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/remote/load_remote.h"
#include "common/remote/read_remote.h"
#include "common/util/parallel.h"
#include "common/util/result.h"
#include "server/serve/catalogue.h"
#include "server/serve/memory.h"
#include "server/serve/scale_demand.h"

namespace intervale {

struct RemoteInputs {
  std::vector<RemoteUrl> urls;
  RemoteAccess access;
  RemoteLimits limits = {};                     // most_bytes: the memory's room counts, too
  std::chrono::milliseconds poll_time{60'000};  // between questions whether a file has changed
};

// One thread at a time. What was read of a file lies in memory: what becomes of it on its server does not affect sessions.
class RemoteDataSets {
 public:
  struct DataSet {
    RemoteUrl url;
    Catalogue::Volume volume;                      // the last good contents; nullptr: not read yet
    RemoteStamp stamp;                             // of what was read last
    std::string last_warning;                      // logged since then, not to be repeated
    std::unique_ptr<RemoteVolume> rest = nullptr;  // which is read on; nullptr: all of it was read, or could not be
    Catalogue::Volume coarse = nullptr;            // on demand, its coarsest scales, where these were read first
  };

  // memory: counts the data sets, and must outlive them. Callers have a Scope of its data memory. tolerates_damage: as
  // and demand: as of CatalogueWatcher.
  RemoteDataSets(RemoteInputs inputs, Memory& memory, bool tolerates_damage, ScaleDemand* demand = nullptr);
  RemoteDataSets(const RemoteDataSets&) = delete;
  RemoteDataSets& operator=(const RemoteDataSets&) = delete;

  // Reads all of them; of large files of every range the coarse scales, if memory is not limited. Fails if one cannot be
  // read. Throws what `parallel` throws.
  Result<void> load(const ParallelFor& parallel);

  // After load(): the data set with fewest updates whose rest is to be read; nullptr: there is none. taken: names under
  // which others are served, which nobody can ask for.
  [[nodiscard]] DataSet* unfinished(const std::set<std::string>& taken);
  // Reads on of it, as far as the next scale. If that fails, it is logged, and what was read before stays: poll() tries
  // to read all of it; on demand, it is refused, and tried again when it is asked for again.
  void read_on(DataSet& set, const ParallelFor& parallel);
  // On demand: drops the finer scales of those that no session has used for so long. Whether there were any.
  bool drop_unused(ScaleDemand::Clock::duration time);

  // Once poll_time is over, asks for each whether it has changed, and reads those that have, whole. True if contents are
  // new. What fails is logged, and tried again the next time; the last good contents stay. A server that sends neither
  // ETag nor Last-Modified is not asked.
  bool poll(const ParallelFor& parallel);

  [[nodiscard]] const std::vector<DataSet>& all() const { return sets_; }

 private:
  bool poll_one(DataSet& set, const ParallelFor& parallel);
  Result<bool> read(DataSet& set, const RemoteLimits& limits, const ParallelFor& parallel);
  Result<void> read_next(DataSet& set, const ParallelFor& parallel);
  void begin(DataSet& set);
  void keep_coarse(DataSet& set, const ParallelFor& parallel);

  RemoteInputs inputs_;
  Memory& memory_;
  bool tolerates_damage_;
  ScaleDemand* demand_;
  std::vector<DataSet> sets_;
  std::chrono::steady_clock::time_point next_poll_{};
};

}  // namespace intervale
