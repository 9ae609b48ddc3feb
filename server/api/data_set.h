// Data sets: built from volumes or read from .ivm files, and the meshes of any ranges that they have.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/api/data_set_info.h"
#include "common/api/mesh_request.h"
#include "common/ivm/value_histogram.h"
#include "common/mesh/mesh.h"
#include "common/patch/volume.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

// Another field on the grid of a volume, a scalar or a vector of 3, that meshes can bring along.
struct ChannelVolume {
  std::string name;  // UTF-8 of at most 64 bytes, other than surface, value and range
  Volume volume;
  std::optional<double> step = {};  // as DataSetOptions::step
};

struct DataSetOptions {
  // The closed range of values to keep; none: every range.
  std::optional<Range> range = {};
  // Of a range: its surfaces, or its inside, too.
  Refine refine = Refine::boundary;
  // Distance of the values that floats are rounded to, so that each is off by half of it at most; 0: exact. None: exact if
  // 65,536 steps are enough, else a power of two: 2,048 to 4,096 steps from the least to the greatest value.
  std::optional<double> step = {};
  // Replaces NaN and infinite samples; without it they are an error.
  std::optional<double> nan = {};
  // At most 16. Their samples are freed once they are built.
  std::vector<ChannelVolume> channels = {};
  // Called with the fraction done, 0 to 1, from any thread, one call at a time.
  std::function<void(double)> progress = {};
};

// Immutable; copies share it. All functions may be called from any threads. They use all cores that oneTBB may.
class INTERVALE_EXPORT DataSet {
 public:
  // volume: scalar; its name becomes the data set's.
  [[nodiscard]] static Result<DataSet> build(Volume volume, DataSetOptions options = {});
  // Reads an .ivm file. Its name is the file's, without folders and extension.
  [[nodiscard]] static Result<DataSet> open(const std::filesystem::path& path);
  // The bytes of an .ivm file, from any source: checks all of them.
  [[nodiscard]] static Result<DataSet> decode(std::vector<std::byte> bytes, std::string name);

  [[nodiscard]] const DataSetInfo& info() const;
  // Writes a temporary file and renames it.
  [[nodiscard]] Result<void> save(const std::filesystem::path& path) const;
  // The mesh of a level of detail: that which a client has at the end of the same request's stream. Its values are those
  // of the points. The first call for a data set of every range that was built here takes a second copy of its values.
  [[nodiscard]] Result<Mesh> extract(const MeshRequest& request = {}) const;

  // Of the samples, to choose a range by. None: the data set is of one range.
  [[nodiscard]] std::optional<ValueHistogram> histogram() const;
  // The volume that the closed range encloses, in world units cubed, from a table: off by 0.1 % of the box at most. None:
  // the data set is of one range.
  [[nodiscard]] std::optional<double> enclosed_volume(const Range& range) const;

 private:
  struct Data;
  explicit DataSet(std::shared_ptr<Data> data);
  std::shared_ptr<Data> data_;
};

}  // namespace intervale
