#include "server/serve/catalogue.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/util/printable.h"
#include "protocol/limits.h"

namespace intervale {
namespace {

// Well-formed UTF-8 (The Unicode Standard, table 3-7): no overlong forms, no surrogates, nothing above U+10FFFF.
bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const auto lead = static_cast<unsigned char>(text.front());
    const std::size_t more = lead < 0x80 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
    if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4 || text.size() <= more) return false;
    for (std::size_t i = 1; i <= more; ++i) {
      const auto c = static_cast<unsigned char>(text[i]);
      const bool first = i == 1;
      const unsigned low = first && lead == 0xe0 ? 0xa0 : first && lead == 0xf0 ? 0x90 : 0x80;
      const unsigned high = first && lead == 0xed ? 0x9f : first && lead == 0xf4 ? 0x8f : 0xbf;
      if (c < low || c > high) return false;
    }
    text.remove_prefix(1 + more);
  }
  return true;
}

// Names occur in URLs, JSON, metrics, logs and terminals.
bool is_valid_name(const std::string& name) {
  return !name.empty() && name.size() <= protocol::kMaxName && is_utf8(name) && printable(name) == name &&
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
  if (!volumes_.emplace(name, std::move(volume)).second) return fail("two data sets are named '" + name + "': rename one of the files");
  return {};
}

Catalogue::Volume Catalogue::find(std::string_view name) const {
  const auto found = volumes_.find(name);
  return found == volumes_.end() ? nullptr : found->second;
}

}  // namespace intervale
