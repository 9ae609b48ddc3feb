// The data sets that a server offers, by name.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "common/ivm/interval_volume.h"
#include "common/util/parallel.h"
#include "common/util/result.h"
#include "server/serve/memory.h"

namespace intervale {

// Data sets are immutable and shared; a pointer from find() stays valid. Reading is safe from any thread once the
// catalogue is filled.
class Catalogue {
 public:
  using Volume = std::shared_ptr<const IntervalVolume>;

  // Failure: the name is not a valid path segment of a URL, or not UTF-8.
  static Result<void> check_name(const std::string& name);

  // Adds it under its description's name. Failure: the name is taken, or invalid, or the description cannot be sent
  // (protocol::check_sendable()).
  Result<void> add(Volume volume);

  [[nodiscard]] Volume find(std::string_view name) const;  // nullptr: none
  [[nodiscard]] const std::map<std::string, Volume, std::less<>>& volumes() const { return volumes_; }

 private:
  std::map<std::string, Volume, std::less<>> volumes_;
};

// What a data set that lies in data memory needs for ranges: made now, for a session would make it elsewhere. On the thread
// that loads it. Throws what `parallel` throws, and ScratchFull.
void complete_in_data_memory(const IntervalVolume& volume, const Memory& memory, const ParallelFor& parallel);

}  // namespace intervale
