#include "common/api/data_set_holder.h"

#include <cmath>
#include <mutex>
#include <utility>

#include "common/api/describe_data_set.h"
#include "common/ivm/every_range.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "common/mesh/join.h"
#include "common/parallel/all_cores.h"
#include "common/ranges/extract_meshes.h"

namespace intervale {
namespace {

double box_volume(const Grid& grid) {
  return std::abs(grid.affine.determinant()) * double(grid.dims[0] - 1) * double(grid.dims[1] - 1) * double(grid.dims[2] - 1);
}

// What meshes come from.
class FromMeshes : public DataSetHolder {
 public:
  [[nodiscard]] const DataSetInfo& info() const final { return info_; }

  [[nodiscard]] Result<Mesh> extract(const MeshRequest& request) final {
    if (auto valid = check_request(request); !valid) return tl::unexpected(valid.error());
    const auto volume = to_extract_from();
    if (!volume) return tl::unexpected(volume.error());
    const Description& d = (*volume)->description();
    if (d.has_every_range && request.shown.ranges.empty()) return misuse("'" + d.name + "' has every range: say which");
    const ShownRanges shown = resolve(d, request.shown);
    if (auto held = check_held(d, shown); !held) return tl::unexpected(held.error());
    const auto channels = find_channels(d.channels, request.channels);
    if (!channels) return tl::unexpected(channels.error());
    auto extracted = extract_meshes(*volume, shown, request.lod, *channels, on_all_cores);
    if (!extracted) return tl::unexpected(extracted.error());
    std::vector<Mesh> meshes;
    for (ExtractedMesh& one : *extracted) meshes.push_back(std::move(one.mesh));
    return joined(std::move(meshes));
  }

  [[nodiscard]] std::optional<ValueHistogram> histogram() const final {
    if (info_.shown) return {};
    return statistics().histogram;
  }

  [[nodiscard]] std::optional<double> enclosed_volume(const Range& range) const final {
    if (info_.shown) return {};
    return box_volume(info_.grid) * statistics().volumes.share_of(range);
  }

 protected:
  using Volume = std::shared_ptr<const IntervalVolume>;
  explicit FromMeshes(DataSetInfo info) : info_(std::move(info)) {}
  [[nodiscard]] virtual Result<Volume> to_extract_from() = 0;
  [[nodiscard]] virtual const FieldStatistics& statistics() const = 0;  // of a data set of every range

 private:
  DataSetInfo info_;
};

class HeldVolume final : public FromMeshes {
 public:
  HeldVolume(Volume volume, std::vector<std::byte> file)
      : FromMeshes(info_of(volume->description())), volume_(std::move(volume)), file_(std::move(file)) {}

  [[nodiscard]] Result<void> save(const std::filesystem::path& path) const override {
    return file_.empty() ? save_ivm(path, *volume_, on_all_cores) : save_container(path, file_);
  }

 private:
  [[nodiscard]] Result<Volume> to_extract_from() override { return volume_; }
  [[nodiscard]] const FieldStatistics& statistics() const override { return *volume_->statistics(); }
  Volume volume_;
  std::vector<std::byte> file_;
};

DataSetInfo info_of_values(const ValueVolume& values) {
  const FieldDescription& field = values.description();
  Description d;
  d.name = field.name;
  d.grid = field.grid;
  d.labels = field.labels;
  d.has_every_range = true;
  d.format = field.format;
  d.max_error = field.max_error;
  d.updates = values.set().size();
  d.channels = field.channels;
  return info_of(d);
}

class HeldValues final : public FromMeshes {
 public:
  explicit HeldValues(ValueVolume values) : FromMeshes(info_of_values(values)), values_(std::move(values)) {}

  [[nodiscard]] Result<void> save(const std::filesystem::path& path) const override {
    if (auto saved = save_values(path, values_, on_all_cores); !saved) return tl::unexpected(saved.error());
    return {};
  }

 private:
  [[nodiscard]] Result<Volume> to_extract_from() override {
    const std::lock_guard lock(mutex_);
    if (volume_) return volume_;
    auto every = of_every_range(values_.parts(), on_all_cores);
    if (!every) return tl::unexpected(every.error());
    volume_ = std::make_shared<const IntervalVolume>(std::move(*every));
    return volume_;
  }
  [[nodiscard]] const FieldStatistics& statistics() const override { return values_.description().statistics; }

  ValueVolume values_;
  std::mutex mutex_;  // of `volume_`
  Volume volume_;     // once a mesh was asked for
};

}  // namespace

std::shared_ptr<DataSetHolder> hold(IntervalVolume volume, std::vector<std::byte> file) {
  return std::make_shared<HeldVolume>(std::make_shared<const IntervalVolume>(std::move(volume)), std::move(file));
}

std::shared_ptr<DataSetHolder> hold(ValueVolume values) { return std::make_shared<HeldValues>(std::move(values)); }

}  // namespace intervale
