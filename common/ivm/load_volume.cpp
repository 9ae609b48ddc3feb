#include "common/ivm/load_volume.h"

#include <utility>

#include "common/ivm/every_range.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"

namespace intervale {

Result<std::vector<std::byte>> read_volume_file(const std::filesystem::path& path, const ParallelFor& parallel) {
  return read_container(path, {}, parallel);
}

Result<IntervalVolume> decode_volume(std::span<const std::byte> bytes, std::string name, const ParallelFor& parallel, std::uint64_t room,
                                     PageFaults* faults) {
  if (scope_of(bytes) != FileScope::every_range) return decode_ivm(bytes, std::move(name), parallel, room, faults);
  auto values = decode_values(bytes, std::move(name), parallel, room, faults);
  if (!values) return tl::unexpected(values.error());
  return of_every_range(std::move(*values).take(), parallel);
}

Result<IntervalVolume> decode_needed_volume(const FileEnds& file, std::string name, const std::vector<bool>& pages, const ParallelFor& parallel) {
  auto values = decode_needed_values(file, std::move(name), pages, parallel);
  if (!values) return tl::unexpected(values.error());
  return of_every_range(std::move(*values).take(), parallel);
}

Result<std::shared_ptr<const IntervalVolume>> load_volume(const std::filesystem::path& path, const ParallelFor& parallel, PageFaults* faults) {
  const auto bytes = read_volume_file(path, parallel);
  if (!bytes) return tl::unexpected(bytes.error());
  auto volume = decode_volume(*bytes, path.stem().string(), parallel, kAnyRoom, faults);
  if (!volume) return fail(path.string() + ": " + volume.error().message);
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

}  // namespace intervale
