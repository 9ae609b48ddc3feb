// The data sets a server offers, by name.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "common/ivm/interval_volume.h"
#include "common/util/result.h"

namespace intervale {

// Data sets are immutable and shared: whoever found one keeps it as long as needed. Reading is safe from any thread once filled.
class Catalogue {
 public:
  using Volume = std::shared_ptr<const IntervalVolume>;

  // Failure: unfit for a URL's path, or no UTF-8.
  static Result<void> check_name(const std::string& name);

  // Under its description's name. Failure: the name is taken, or unfit.
  Result<void> add(Volume volume);

  [[nodiscard]] Volume find(std::string_view name) const;  // nullptr if there is none
  [[nodiscard]] const std::map<std::string, Volume, std::less<>>& volumes() const { return volumes_; }

 private:
  std::map<std::string, Volume, std::less<>> volumes_;
};

}  // namespace intervale
