#include "common/api/data_set.h"

#include <utility>

#include "common/api/data_set_holder.h"
#include "common/ivm/load_volume.h"
#include "common/parallel/all_cores.h"

namespace intervale {

DataSet::DataSet(std::shared_ptr<DataSetHolder> holder) : holder_(std::move(holder)) {}

Result<DataSet> DataSet::open(const std::filesystem::path& path) {
  auto bytes = read_volume_file(path, on_all_cores);
  if (!bytes) return tl::unexpected(bytes.error());
  auto set = decode(std::move(*bytes), path.stem().string());
  if (!set) return fail(path.string() + ": " + set.error().message);
  return set;
}

Result<DataSet> DataSet::decode(std::vector<std::byte> bytes, std::string name) {
  auto volume = decode_volume(bytes, std::move(name), on_all_cores);
  if (!volume) return tl::unexpected(volume.error());
  return DataSet(hold(std::move(*volume), std::move(bytes)));
}

const DataSetInfo& DataSet::info() const { return holder_->info(); }
Result<void> DataSet::save(const std::filesystem::path& path) const { return holder_->save(path); }
Result<Mesh> DataSet::extract(const MeshRequest& request) const { return holder_->extract(request); }
std::optional<ValueHistogram> DataSet::histogram() const { return holder_->histogram(); }
std::optional<double> DataSet::enclosed_volume(const Range& range) const { return holder_->enclosed_volume(range); }

}  // namespace intervale
