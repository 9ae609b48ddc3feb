#include <pybind11/functional.h>

#include <chrono>
#include <functional>
#include <optional>

#include "client/python/bindings.h"
#include "intervale/fetch_mesh.h"
#include "intervale/live_mesh.h"

namespace intervale::python {
namespace {

using Release = py::call_guard<py::gil_scoped_release>;

Access access_of(std::optional<std::string> token, std::optional<std::string> ca) {
  Access access;
  access.token = std::move(token);
  if (ca) access.authorities = *ca;
  return access;
}

// A LiveMesh that can be closed before Python forgets it.
struct Stream {
  std::optional<LiveMesh> live;
  LiveMesh& open() {
    if (!live) throw py::value_error("the stream is closed");
    return *live;
  }
};

}  // namespace

void add_streams(py::module_& module) {
  py::class_<MeshState>(module, "MeshState")
      .def_property_readonly("mesh", [](const MeshState& state) { return held(state.mesh); })
      .def_readonly("is_done", &MeshState::is_done)
      .def_readonly("remaining_error", &MeshState::remaining_error)
      .def_readonly("remaining_pixels", &MeshState::remaining_pixels)
      .def_readonly("updates", &MeshState::updates)
      .def_readonly("bytes", &MeshState::bytes);
  py::class_<Stream>(module, "LiveMesh")
      .def_property_readonly("_info", [](Stream& stream) { return stream.open().info(); })
      .def(
          "look", [](Stream& stream, const MeshRequest& request) { value_of(stream.open().look(request), Kind::connection); }, Release())
      .def(
          "wait",
          [](Stream& stream, double seconds) {
            return value_of(stream.open().wait(std::chrono::milliseconds(long(1000 * seconds))), Kind::connection);
          },
          py::arg("seconds"), Release())
      .def(
          "close", [](Stream& stream) { stream.live.reset(); }, Release());
  module.def(
      "connect",
      [](const std::string& url, const MeshRequest& request, std::optional<std::string> token, std::optional<std::string> ca, long reconnect,
         bool prefetch_ranges) {
        const LiveMeshOptions options{access_of(std::move(token), std::move(ca)), std::chrono::seconds(reconnect), prefetch_ranges};
        return Stream{value_of(LiveMesh::connect(url, request, options), Kind::connection)};
      },
      py::arg("url"), py::arg("request"), py::arg("token"), py::arg("ca"), py::arg("reconnect"), py::arg("prefetch_ranges"), Release());
  module.def(
      "list_data_sets",
      [](const std::string& url, std::optional<std::string> token, std::optional<std::string> ca) {
        return value_of(list_data_sets(url, access_of(std::move(token), std::move(ca))), Kind::connection);
      },
      py::arg("url"), py::arg("token"), py::arg("ca"), Release());
}

}  // namespace intervale::python
