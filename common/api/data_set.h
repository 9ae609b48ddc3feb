// Data sets: .ivm files as they are read or built, and the meshes of any ranges that they have.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/api/data_set_info.h"
#include "common/api/mesh_request.h"
#include "common/ivm/value_histogram.h"
#include "common/mesh/mesh.h"
#include "common/patch/shown_range.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

class DataSetHolder;

// Immutable; copies share it. All functions may be called from any threads. They use all cores that oneTBB may.
class INTERVALE_EXPORT DataSet {
 public:
  // Reads an .ivm file. Its name is the file's, without folders and extension.
  [[nodiscard]] static Result<DataSet> open(const std::filesystem::path& path);
  // The bytes of an .ivm file, from any source: checks all of them.
  [[nodiscard]] static Result<DataSet> decode(std::vector<std::byte> bytes, std::string name);
  // For the libraries: programs have none of these. holder: not null.
  explicit DataSet(std::shared_ptr<DataSetHolder> holder);

  [[nodiscard]] const DataSetInfo& info() const;
  // Writes a temporary file and renames it.
  [[nodiscard]] Result<void> save(const std::filesystem::path& path) const;
  // The mesh of a level of detail: that which a client has at the end of the same request's stream. Its values are those
  // of the points. The first call for a data set of every range that was built by this process takes a second copy of
  // its values.
  [[nodiscard]] Result<Mesh> extract(const MeshRequest& request = {}) const;

  // Of the samples, to choose a range by. None: the data set is of one range.
  [[nodiscard]] std::optional<ValueHistogram> histogram() const;
  // The volume that the closed range encloses, in world units cubed, from a table: off by 0.1 % of the box at most. None:
  // the data set is of one range.
  [[nodiscard]] std::optional<double> enclosed_volume(const Range& range) const;

 private:
  std::shared_ptr<DataSetHolder> holder_;
};

}  // namespace intervale
