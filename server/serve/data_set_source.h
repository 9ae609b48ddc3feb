// Where a server's data sets come from.
#pragma once

#include <chrono>
#include <optional>

#include "common/util/parallel.h"
#include "common/util/result.h"
#include "server/serve/catalogue.h"

namespace intervale {

// One thread at a time. Data sets are in memory, or data memory: what becomes of their files does not affect sessions.
// `parallel` may stop load(), complete() and poll(): they throw what it throws.
class DataSetSource {
 public:
  virtual ~DataSetSource() = default;

  // First: the data sets at the start. Of large files of every range without channels, their coarse scales
  // (coarse_scales.h).
  virtual Result<Catalogue> load(const ParallelFor& parallel) = 0;

  // Then: reads on, of the data set that has fewest updates of those that are not whole and of which more is wanted: as
  // far as the next scale, at last all of it. Returns the new catalogue; nullopt once nothing more is wanted.
  virtual Result<std::optional<Catalogue>> complete(const ParallelFor& parallel) = 0;

  // Looks for changes of the files. Returns the new catalogue, or nullopt if nothing changed.
  virtual std::optional<Catalogue> poll(const ParallelFor& parallel) = 0;

  // On demand: drops the finer scales of data sets that no session has used for so long. Returns the new catalogue, or
  // nullopt if there were none.
  virtual std::optional<Catalogue> drop_unused(std::chrono::steady_clock::duration time) = 0;
};

}  // namespace intervale
