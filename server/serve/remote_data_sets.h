// The data sets of a server that are files on web servers.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/remote/load_remote.h"
#include "common/remote/read_remote.h"
#include "common/util/parallel.h"
#include "common/util/result.h"
#include "server/serve/catalogue.h"
#include "server/serve/data_set_source.h"
#include "server/serve/memory.h"
#include "server/serve/scale_demand.h"

namespace intervale {

struct RemoteInputs {
  std::vector<RemoteUrl> urls;
  RemoteAccess access;
  RemoteLimits limits = {};                     // most_bytes: the memory's room counts, too
  std::chrono::milliseconds poll_time{60'000};  // between questions whether a file has changed
};

// Each is read into memory. A file on a server that sends neither ETag nor Last-Modified is not looked at again.
class RemoteDataSets : public DataSetSource {
 public:
  // memory: counts the data sets, and must outlive them; if it has data memory, they lie there. tolerates_damage and
  // demand: as of CatalogueWatcher.
  RemoteDataSets(RemoteInputs inputs, Memory& memory, bool tolerates_damage = false, ScaleDemand* demand = nullptr);
  RemoteDataSets(const RemoteDataSets&) = delete;
  RemoteDataSets& operator=(const RemoteDataSets&) = delete;

  // Where memory is limited, and with tolerates_damage, all of each is read. Fails if one cannot be read, and if two
  // have one name.
  Result<Catalogue> load(const ParallelFor& parallel = serial) override;
  // What cannot be read is logged, and what was read before stays: poll() tries to read all of it; on demand, it is
  // refused, and tried again when it is asked for again.
  Result<std::optional<Catalogue>> complete(const ParallelFor& parallel = serial) override;
  // Once poll_time is over, asks for each whether it has changed, and reads those that have: whole, or on demand their
  // coarse scales. What fails is logged, and tried again the next time; the last good contents stay.
  std::optional<Catalogue> poll(const ParallelFor& parallel = serial) override;
  std::optional<Catalogue> drop_unused(ScaleDemand::Clock::duration time) override;

 private:
  struct DataSet {
    RemoteUrl url;
    Catalogue::Volume volume;                      // the last good contents; nullptr: not read yet
    RemoteStamp stamp;                             // of what was read last
    std::string last_warning;                      // logged since then, not to be repeated
    std::unique_ptr<RemoteVolume> rest = nullptr;  // which is read on; nullptr: all of it was read, or could not be
    Catalogue::Volume coarse = nullptr;            // on demand, its coarsest scales, where these were read first
  };

  static void warn(DataSet& set, const std::string& why);
  [[nodiscard]] Catalogue catalogue() const;
  void read_on(DataSet& set, const ParallelFor& parallel);
  bool poll_one(DataSet& set, const ParallelFor& parallel);
  Result<bool> read_if_changed(DataSet& set, const ParallelFor& parallel);
  Result<bool> read(DataSet& set, const RemoteLimits& limits, const ParallelFor& parallel);
  Result<void> read_next(DataSet& set, const ParallelFor& parallel);
  void begin(DataSet& set);

  RemoteInputs inputs_;
  RemoteLimits once_;  // a request that fails is not repeated: there is another try soon
  Memory& memory_;
  bool tolerates_damage_;
  ScaleDemand* demand_;
  std::vector<DataSet> sets_;
  std::chrono::steady_clock::time_point next_poll_{};
};

}  // namespace intervale
