// Not installed: what a DataSet holds. Its functions are virtual, so that the code of the library that made a data set
// works on it: volumes may be laid out otherwise in another version of another library.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <vector>

#include "common/api/data_set_info.h"
#include "common/api/mesh_request.h"
#include "common/ivm/field_statistics.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/value_volume.h"
#include "common/mesh/mesh.h"
#include "common/util/result.h"

namespace intervale {

class DataSetHolder {
 public:
  virtual ~DataSetHolder() = default;
  // As those of DataSet.
  [[nodiscard]] virtual const DataSetInfo& info() const = 0;
  [[nodiscard]] virtual Result<void> save(const std::filesystem::path& path) const = 0;
  [[nodiscard]] virtual Result<Mesh> extract(const MeshRequest& request) = 0;
  [[nodiscard]] virtual std::optional<ValueHistogram> histogram() const = 0;
  [[nodiscard]] virtual std::optional<double> enclosed_volume(const Range& range) const = 0;
};

// file: the bytes that the volume was read from; empty: it was built.
[[nodiscard]] std::shared_ptr<DataSetHolder> hold(IntervalVolume volume, std::vector<std::byte> file = {});
// Of every range, built.
[[nodiscard]] std::shared_ptr<DataSetHolder> hold(ValueVolume values);

}  // namespace intervale
