#include "server/serve/catalogue.h"

#include <algorithm>
#include <utility>

#include "protocol/limits.h"

namespace intervale {
namespace {

// A name stands in URLs, logs and terminals.
bool fit_for_a_url(const std::string& name) {
  return !name.empty() && name.size() <= protocol::kMaxName &&
         std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f || c == '/' || c == '?' || c == '#'; });
}

}  // namespace

Result<void> Catalogue::add(Volume volume) {
  const std::string name = volume->description().name;
  if (!fit_for_a_url(name)) return fail("a data set's name must be 1 to 255 bytes without / ? # and control characters: rename the file");
  if (!volumes_.emplace(name, std::move(volume)).second) return fail("two data sets are named '" + name + "': rename one of the files");
  return {};
}

Catalogue::Volume Catalogue::find(std::string_view name) const {
  const auto found = volumes_.find(name);
  return found == volumes_.end() ? nullptr : found->second;
}

}  // namespace intervale
