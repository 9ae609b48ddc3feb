#include "server/resume/fingerprint.h"

#include <sys/stat.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "common/ivm/ivm_container.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"

namespace intervale {
namespace {

constexpr std::uint32_t kCheckpointVersion = 1;  // greater with each change of what a build keeps, or of how it finds it

std::filesystem::path absolute_of(const std::filesystem::path& path) { return std::filesystem::absolute(path).lexically_normal(); }

tl::unexpected<Error> cannot_read(const std::filesystem::path& path, int error) {
  return fail("cannot read '" + path.string() + "': " + std::generic_category().message(error));
}

// The files in a folder and below, in an order of their own.
Result<std::vector<std::filesystem::path>> files_in(const std::filesystem::path& folder, std::span<const std::filesystem::path> left_out) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::filesystem::path path = absolute_of(entry->path());
    const bool is_temporary = path.filename().string().starts_with(".intervale-");  // of a build, or of another one beside it
    std::error_code ignored;
    if (is_temporary || entry->is_directory(ignored) || std::find(left_out.begin(), left_out.end(), path) != left_out.end()) continue;
    files.push_back(path);
  }
  if (error) return cannot_read(folder, error.value());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

Fingerprint::Fingerprint() {
  add(std::string(INTERVALE_VERSION));
  add(kIvmVersion);
  add(kCheckpointVersion);
}

void Fingerprint::append(const void* bytes, std::size_t count) { bytes_.append(static_cast<const char*>(bytes), count); }

Result<void> Fingerprint::add_input(const std::filesystem::path& input, std::span<const std::filesystem::path> left_out) {
  std::vector<std::filesystem::path> left_out_absolute;
  for (const auto& path : left_out) left_out_absolute.push_back(absolute_of(path));
  std::vector<std::filesystem::path> files{absolute_of(input)};
  std::error_code ignored;
  if (std::filesystem::is_directory(input, ignored)) {
    auto found = files_in(files[0], left_out_absolute);
    if (!found) return tl::unexpected(found.error());
    add(files[0].string());
    files = std::move(*found);
  } else if (const auto header = read_volume_header(input); header && *header && (*header)->data_file) {
    files.push_back(absolute_of(files[0].parent_path() / *(*header)->data_file));
  }
  add(files.size());
  for (const auto& file : files) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return cannot_read(file, errno);
    add(file.string());
    add(std::uint64_t(status.st_size));
    // The second one, which programs cannot set, changes also where a file is replaced by one of the same size and time.
    for (const timespec& time : {status.st_mtim, status.st_ctim}) {
      add(std::int64_t(time.tv_sec));
      add(std::int64_t(time.tv_nsec));
    }
  }
  return {};
}

std::uint64_t Fingerprint::value() const { return XXH3_64bits(bytes_.data(), bytes_.size()); }

}  // namespace intervale
