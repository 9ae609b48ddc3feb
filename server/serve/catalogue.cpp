#include "server/serve/catalogue.h"

#include <algorithm>
#include <utility>

#include "common/util/printable.h"
#include "common/util/utf8.h"
#include "protocol/codec.h"
#include "protocol/limits.h"

namespace intervale {
namespace {

// Names occur in URLs, JSON, metrics, logs and terminals.
bool is_valid_name(const std::string& name) {
  return !name.empty() && name.size() <= protocol::kMaxName && is_utf8(name) && !has_control_characters(name) &&
         std::none_of(name.begin(), name.end(), [](char c) { return c == '/' || c == '?' || c == '#'; });
}

}  // namespace

Result<void> Catalogue::check_name(const std::string& name) {
  if (is_valid_name(name)) return {};
  return fail("the name of a data set must be 1 to 255 bytes of UTF-8, without / ? # and control characters: rename the file");
}

Result<void> Catalogue::add(Volume volume) {
  const std::string name = volume->description().name;
  if (auto valid = check_name(name); !valid) return valid;
  if (auto fits = protocol::check_sendable(volume->description()); !fits) return fail("'" + name + "': " + fits.error().message);
  if (!volumes_.emplace(name, std::move(volume)).second) return fail("two data sets are named '" + name + "': rename one of the files");
  return {};
}

Catalogue::Volume Catalogue::find(std::string_view name) const {
  const auto found = volumes_.find(name);
  return found == volumes_.end() ? nullptr : found->second;
}

void complete_in_data_memory(const IntervalVolume& volume, const Memory& memory, const ParallelFor& parallel) {
  if (memory.data_memory() != nullptr && volume.description().refine == Refine::uniform) (void)volume.bounds(parallel);
}

}  // namespace intervale
