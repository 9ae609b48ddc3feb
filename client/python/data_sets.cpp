#include <oneapi/tbb/global_control.h>
#include <pybind11/functional.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/python/bindings.h"
#include "intervale/build.h"
#include "intervale/data_set.h"
#include "intervale/read_volume.h"
#include "intervale/samples.h"

namespace intervale::python {
namespace {

using Release = py::call_guard<py::gil_scoped_release>;

constexpr const char* kTypes[] = {"uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"};

SampleType type_of(const py::array& array) {
  const auto name = py::str(array.dtype().attr("name")).cast<std::string>();
  const auto* const found = std::find(std::begin(kTypes), std::end(kTypes), name);
  if (found == std::end(kTypes)) throw py::value_error("samples are integers of 8, 16 or 32 bits or floats of 32 or 64 bits, not " + name);
  return SampleType(found - std::begin(kTypes));
}

// array: z, y, x, and the components of a vector; contiguous. Copies the samples: building changes them.
Volume make_volume(const py::array& array, const std::array<double, 12>& affine, std::string name, Labels labels) {
  if (array.ndim() != 3 && array.ndim() != 4) throw py::value_error("a volume has three axes, or four with the components of vectors");
  if ((array.flags() & py::array::c_style) == 0) throw py::value_error("the array is not contiguous");
  Volume volume;
  volume.name = std::move(name);
  for (int axis = 0; axis < 3; ++axis) {
    if (array.shape(2 - axis) > kMaxSide) throw py::value_error("an axis has more than 2^20 samples");
    volume.grid.dims[axis] = std::int32_t(array.shape(2 - axis));
  }
  volume.grid.affine.rows = affine;
  volume.labels = std::move(labels);
  volume.type = type_of(array);
  volume.components = array.ndim() == 4 ? unsigned(array.shape(3)) : 1;
  const std::span bytes(static_cast<const std::byte*>(array.data()), std::size_t(array.nbytes()));
  const py::gil_scoped_release release;
  volume.bytes.assign(bytes.begin(), bytes.end());
  return volume;
}

py::array samples_of(const py::object& self) {
  const auto& volume = self.cast<const Volume&>();
  const auto& d = volume.grid.dims;
  std::vector<py::ssize_t> shape{d[2], d[1], d[0]};
  if (volume.components > 1) shape.push_back(volume.components);
  const py::dtype type(kTypes[int(volume.type)]);
  py::array array(type, std::move(shape), volume.bytes.data(), self);
  array.attr("flags").attr("writeable") = false;
  return array;
}

using FirstAndLast = std::array<std::array<std::int64_t, 2>, 3>;  // on x, y and z

std::optional<SampleBox> box_of(const std::optional<FirstAndLast>& crop) {
  if (!crop) return {};
  SampleBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.first[axis] = (*crop)[axis][0];
    box.last[axis] = (*crop)[axis][1];
  }
  return box;
}

DataSet build(const Volume& volume, std::optional<std::array<double, 2>> range, const std::string& refine, std::optional<double> step,
              std::optional<double> nan, const std::vector<std::tuple<std::string, Volume, std::optional<double>>>& channels,
              std::function<void(double)> progress, unsigned threads) {
  DataSetOptions options;
  if (range) options.range = Range{(*range)[0], (*range)[1]};
  if (refine != "boundary" && refine != "uniform") throw py::value_error("refine is 'boundary' or 'uniform'");
  options.refine = refine == "uniform" ? Refine::uniform : Refine::boundary;
  options.step = step;
  options.nan = nan;
  options.progress = std::move(progress);
  for (const auto& [name, samples, channel_step] : channels) options.channels.push_back({name, samples, channel_step});
  std::optional<tbb::global_control> limit;
  if (threads != 0) limit.emplace(tbb::global_control::max_allowed_parallelism, threads);
  return value_of(build_data_set(volume, std::move(options)), Kind::format);
}

py::dict info_of(const DataSetInfo& info) {
  py::dict result;
  result["name"] = info.name;
  result["dims"] = py::make_tuple(info.grid.dims[0], info.grid.dims[1], info.grid.dims[2]);
  result["affine"] = info.grid.affine.rows;
  result["unit"] = info.labels.unit;
  result["field"] = info.labels.field;
  result["field_unit"] = info.labels.field_unit;
  result["space"] = info.labels.space;
  result["range"] = info.shown ? py::object(py::make_tuple(info.shown->range.alpha, info.shown->range.beta)) : py::none();
  result["values"] = py::make_tuple(info.values.alpha, info.values.beta);
  result["max_error"] = info.max_error;
  result["updates"] = info.updates;
  py::dict channels;
  for (const ChannelInfo& channel : info.channels) channels[py::str(channel.name)] = py::make_tuple(channel.unit, channel.components);
  result["channels"] = channels;
  return result;
}

}  // namespace

void add_data_sets(py::module_& module) {
  py::class_<Volume>(module, "RawVolume")
      .def(py::init([](const py::array& array, const std::array<double, 12>& affine, std::string name, std::string unit, std::string field,
                       std::string field_unit, std::string space) {
             return make_volume(array, affine, std::move(name), {std::move(unit), std::move(field), std::move(field_unit), std::move(space)});
           }),
           py::arg("array"), py::arg("affine"), py::arg("name"), py::arg("unit"), py::arg("field"), py::arg("field_unit"), py::arg("space"))
      .def_property_readonly("array", &samples_of)
      .def_property_readonly("affine", [](const Volume& v) { return v.grid.affine.rows; })
      .def_property_readonly("name", [](const Volume& v) { return v.name; })
      .def_property_readonly("unit", [](const Volume& v) { return v.labels.unit; })
      .def_property_readonly("field", [](const Volume& v) { return v.labels.field; })
      .def_property_readonly("field_unit", [](const Volume& v) { return v.labels.field_unit; })
      .def_property_readonly("space", [](const Volume& v) { return v.labels.space; });
  module.def(
      "named_volume",
      [](const std::filesystem::path& text, const std::optional<std::string>& part) {
        NamedVolume named = named_volume(text.string(), part);
        return std::pair(std::move(named.path), std::move(named.part));
      },
      py::arg("text"), py::arg("part"));
  module.def(
      "read",
      [](const std::filesystem::path& path, const std::optional<std::string>& part, std::optional<std::uint64_t> time_point,
         const std::optional<FirstAndLast>& crop) { return value_of(read_volume(path, {}, time_point, part, box_of(crop)), Kind::format); },
      py::arg("path"), py::arg("part"), py::arg("time_point"), py::arg("crop"), Release());
  module.def(
      "sample", [](const std::string& name, int size) { return value_of(make_sample(name, size), Kind::format); }, py::arg("name"), py::arg("size"),
      Release());
  py::class_<DataSetInfo>(module, "Info").def("to_dict", &info_of);
  py::class_<DataSet>(module, "DataSet")
      .def_property_readonly("_info", &DataSet::info)
      .def(
          "save", [](const DataSet& set, const std::string& path) { value_of(set.save(path), Kind::system); }, py::arg("path"), Release())
      .def(
          "_extract", [](const DataSet& set, const MeshRequest& request) { return held(value_of(set.extract(request), Kind::format)); }, Release())
      .def("_histogram",
           [](const DataSet& set) -> py::object {
             const auto histogram = set.histogram();
             if (!histogram) return py::none();
             return py::make_tuple(histogram->least, histogram->width, histogram->count);
           })
      .def("_enclosed_volume", [](const DataSet& set, double low, double high) {
        return set.enclosed_volume({low, high});
      });
  module.def("build", &build, py::arg("volume"), py::arg("range"), py::arg("refine"), py::arg("step"), py::arg("nan"), py::arg("channels"),
             py::arg("progress"), py::arg("threads"), Release());
  module.def(
      "open", [](const std::string& path) { return value_of(DataSet::open(path), Kind::format); }, py::arg("path"), Release());
  module.def(
      "decode",
      [](const py::bytes& data, std::string name) {
        const std::string_view text = data;
        std::vector<std::byte> bytes(text.size());
        if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
        const py::gil_scoped_release release;
        return value_of(DataSet::decode(std::move(bytes), std::move(name)), Kind::format);
      },
      py::arg("data"), py::arg("name"));
}

}  // namespace intervale::python
