#include "server/serve/catalogue.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "common/ivm_file.h"
#include "protocol/limits.h"

namespace intervale {
namespace {

namespace fs = std::filesystem;

// A name stands in URLs, logs and terminals.
bool fit_for_a_url(const std::string& name) {
  return !name.empty() && name.size() <= protocol::kMaxName &&
         std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f || c == '/' || c == '?' || c == '#'; });
}

// In order of name, so that the log and the outcome do not depend on the file system's.
Result<std::vector<fs::path>> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (at->path().extension() == ".ivm" && at->is_regular_file(ignored)) files.push_back(at->path());
  }
  if (error) return fail("cannot read the folder " + folder.string() + ": " + error.message());
  std::sort(files.begin(), files.end());
  return files;
}

Result<void> load_folder(Catalogue& catalogue, const fs::path& folder) {
  const auto files = files_in(folder);
  if (!files) return tl::unexpected(files.error());
  for (const fs::path& file : *files) {
    auto volume = load_ivm(file);
    if (!volume) {
      spdlog::warn("left out: {}", volume.error().message);
      continue;
    }
    if (auto added = catalogue.add(std::move(*volume)); !added) return fail(added.error().message + " (" + file.string() + ")");
  }
  return {};
}

}  // namespace

Result<Catalogue> Catalogue::load(const std::vector<fs::path>& inputs) {
  Catalogue catalogue;
  for (const fs::path& input : inputs) {
    std::error_code ignored;
    if (fs::is_directory(input, ignored)) {
      if (auto loaded = load_folder(catalogue, input); !loaded) return tl::unexpected(loaded.error());
      continue;
    }
    auto volume = load_ivm(input);
    if (!volume) return tl::unexpected(volume.error());
    if (auto added = catalogue.add(std::move(*volume)); !added) return fail(added.error().message + " (" + input.string() + ")");
  }
  return catalogue;
}

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
