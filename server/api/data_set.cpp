#include "server/api/data_set.h"

#include <cmath>
#include <mutex>
#include <utility>

#include "common/api/describe_data_set.h"
#include "common/ivm/every_range.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/mesh/join.h"
#include "server/builder/all_cores.h"
#include "server/builder/build_data_set.h"
#include "server/builder/extract_meshes.h"
#include "server/volume/read_volume.h"

namespace intervale {

// Of one range: `meshes`. Of every range: `values` if it was built here, and `meshes` once a mesh was asked for. `file`: of
// one that was read.
struct DataSet::Data {
  std::shared_ptr<const IntervalVolume> meshes;
  std::optional<ValueVolume> values;
  std::vector<std::byte> file;
  DataSetInfo info;
  std::mutex mutex;  // of `meshes`

  [[nodiscard]] const FieldStatistics* statistics() const { return values ? &values->description().statistics : meshes->statistics(); }

  Result<std::shared_ptr<const IntervalVolume>> to_extract_from() {
    const std::lock_guard lock(mutex);
    if (meshes) return meshes;
    auto every = of_every_range(values->parts(), on_all_cores);
    if (!every) return tl::unexpected(every.error());
    meshes = std::make_shared<const IntervalVolume>(std::move(*every));
    return meshes;
  }
};

namespace {

Result<BuiltChannels> build_channels(DataSetOptions& options, const Grid& grid, const SupercubeSet& set) {
  BuiltChannels built;
  for (ChannelVolume& channel : options.channels) {
    if (auto added = add_channel(built, channel.volume, channel.name, channel.step, options.nan, grid, set); !added)
      return tl::unexpected(added.error());
    channel.volume.bytes = std::vector<std::byte>();
  }
  if (auto valid = check_channels(built.channels); !valid) return tl::unexpected(valid.error());
  return built;
}

Result<void> check_samples(Volume& volume, const DataSetOptions& options) {
  if (auto valid = check_grid(volume.grid); !valid) return valid;
  const auto matches = [](const Volume& v) { return v.bytes.size() == v.grid.sample_count() * v.components * size_of(v.type); };
  if (!matches(volume)) return misuse("the volume's bytes are not as many as its samples need");
  if (volume.components != 1) return misuse("the volume has vectors: a field has one number a sample; vectors can be channels");
  if (options.range && !(options.range->alpha <= options.range->beta)) return misuse("the range must be LO <= HI");
  if (!options.range && options.refine != Refine::boundary) return misuse("what to refine is said with a range; every range has all");
  if (options.channels.size() > kMaxChannels) return misuse("at most " + std::to_string(kMaxChannels) + " channels");
  for (const ChannelVolume& channel : options.channels) {
    if (auto valid = check_grid(channel.volume.grid); !valid) return valid;
    if (!matches(channel.volume)) return misuse("the channel's bytes are not as many as its samples need");
    if (channel.volume.components != 1 && channel.volume.components != kMaxComponents) return misuse("a channel has 1 or 3 numbers a sample");
  }
  if (auto valid = check_labels(volume.labels); !valid) return valid;
  return check_finite(volume, options.nan);
}

}  // namespace

DataSet::DataSet(std::shared_ptr<Data> data) : data_(std::move(data)) {}

Result<DataSet> DataSet::build(Volume volume, DataSetOptions options) {
  if (auto valid = check_samples(volume, options); !valid) return tl::unexpected(valid.error());
  auto data = std::make_shared<Data>();
  if (options.range) {
    auto made = build_range(volume, {*options.range, options.refine, options.progress}, options.step);
    if (!made) return tl::unexpected(made.error());
    auto built = build_channels(options, volume.grid, made->set());
    if (!built) return tl::unexpected(built.error());
    if (auto set = made->set_channels(std::move(built->channels), std::move(built->keys)); !set) return tl::unexpected(set.error());
    data->meshes = std::make_shared<const IntervalVolume>(std::move(*made));
    data->info = info_of(data->meshes->description());
    return DataSet(std::move(data));
  }
  auto parts = build_every_range(volume, options.step, options.progress);
  if (!parts) return tl::unexpected(parts.error());
  auto built = build_channels(options, volume.grid, parts->set);
  if (!built) return tl::unexpected(built.error());
  parts->description.channels = std::move(built->channels);
  parts->channel_keys = std::move(built->keys);
  data->values.emplace(std::move(*parts));
  const FieldDescription& field = data->values->description();
  Description d;
  d.name = field.name;
  d.grid = field.grid;
  d.labels = field.labels;
  d.has_every_range = true;
  d.format = field.format;
  d.max_error = field.max_error;
  d.updates = data->values->set().size();
  d.channels = field.channels;
  data->info = info_of(d);
  return DataSet(std::move(data));
}

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
  auto data = std::make_shared<Data>();
  data->meshes = std::make_shared<const IntervalVolume>(std::move(*volume));
  data->file = std::move(bytes);
  data->info = info_of(data->meshes->description());
  return DataSet(std::move(data));
}

const DataSetInfo& DataSet::info() const { return data_->info; }

Result<void> DataSet::save(const std::filesystem::path& path) const {
  if (!data_->file.empty()) return save_container(path, data_->file);
  if (!data_->values) return save_ivm(path, *data_->meshes, on_all_cores);
  if (auto saved = save_values(path, *data_->values, on_all_cores); !saved) return tl::unexpected(saved.error());
  return {};
}

Result<Mesh> DataSet::extract(const MeshRequest& request) const {
  if (auto valid = check_request(request); !valid) return tl::unexpected(valid.error());
  const auto volume = data_->to_extract_from();
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

std::optional<ValueHistogram> DataSet::histogram() const {
  if (data_->info.shown) return {};
  return data_->statistics()->histogram;
}

std::optional<double> DataSet::enclosed_volume(const Range& range) const {
  if (data_->info.shown) return {};
  const Grid& grid = data_->info.grid;
  const double box = std::abs(grid.affine.determinant()) * double(grid.dims[0] - 1) * double(grid.dims[1] - 1) * double(grid.dims[2] - 1);
  return box * data_->statistics()->volumes.share_of(range);
}

}  // namespace intervale
