#include <pybind11/stl/filesystem.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "client/python/bindings.h"
#include "intervale/boundary.h"
#include "intervale/mesh_digest.h"
#include "intervale/mesh_request.h"
#include "intervale/mesh_writer.h"

namespace intervale::python {
namespace {

using Release = py::call_guard<py::gil_scoped_release>;

MeshRequest make_request(const std::vector<std::array<double, 2>>& ranges, const std::optional<std::string>& refine, double error,
                         std::optional<double> error_percent, const std::optional<std::array<Vec3, 2>>& roi, std::optional<Camera> camera,
                         std::optional<std::uint64_t> max_tets, std::optional<std::uint64_t> max_updates, std::vector<std::string> channels) {
  MeshRequest request;
  for (const auto& [low, high] : ranges) request.shown.ranges.push_back({low, high});
  if (refine && *refine != "boundary" && *refine != "uniform") throw py::value_error("refine is 'boundary' or 'uniform'");
  if (refine) request.shown.refine = *refine == "uniform" ? Refine::uniform : Refine::boundary;
  request.lod.error = error;
  request.lod.error_percent = error_percent;
  if (roi) request.lod.roi = Box{(*roi)[0], (*roi)[1]};
  request.lod.camera = camera;
  request.lod.max_tets = max_tets;
  request.lod.max_updates = max_updates;
  request.channels = std::move(channels);
  value_of(check_request(request), Kind::format);
  return request;
}

Camera make_camera(const Vec3& eye, const Vec3& look_at, const Vec3& up, double fov, const std::array<int, 2>& viewport, double pixel_error) {
  return {eye, look_at, up, fov, viewport, pixel_error};
}

template <class T>
py::ssize_t count(const T& array) {
  return py::ssize_t(array.size());
}

py::dict channels_of(const py::object& self) {
  const auto& mesh = self.cast<const Mesh&>();
  py::dict channels;
  for (const PointArray& channel : mesh.channels) {
    std::vector<py::ssize_t> shape{count(mesh.points)};
    if (channel.components > 1) shape.push_back(channel.components);
    channels[py::str(channel.name)] = view_of(channel.value.data(), std::move(shape), self);
  }
  return channels;
}

// An array that keeps the vector: numbers of type Number, one or several for each of its elements.
template <class Number, class T>
py::array array_of(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto kept = std::make_unique<std::vector<T>>(std::move(values));
  const auto* const numbers = reinterpret_cast<const Number*>(kept->data());
  const py::capsule owner(kept.release(), [](void* memory) { delete static_cast<std::vector<T>*>(memory); });
  return py::array_t<Number>(std::move(shape), numbers, owner);
}

py::tuple boundary_of(const Mesh& mesh) {
  BoundaryMesh boundary;
  {
    const py::gil_scoped_release release;
    boundary = boundary_mesh(mesh);
  }
  const py::ssize_t triangles = count(boundary.triangles), points = count(boundary.points);
  return py::make_tuple(array_of<std::uint32_t>(std::move(boundary.points), {points}),
                        array_of<std::uint32_t>(std::move(boundary.triangles), {triangles, 3}));
}

}  // namespace

void add_meshes(py::module_& module) {
  py::class_<Camera>(module, "Camera")
      .def(py::init(&make_camera), py::kw_only(), py::arg("eye"), py::arg("look_at"), py::arg("up") = Vec3{0, 1, 0}, py::arg("fov") = 45.0,
           py::arg("viewport") = std::array{1920, 1080}, py::arg("pixel_error") = 1.0);
  py::class_<MeshRequest>(module, "Request")
      .def(py::init(&make_request), py::kw_only(), py::arg("ranges"), py::arg("refine"), py::arg("error"), py::arg("error_percent"), py::arg("roi"),
           py::arg("camera"), py::arg("max_tets"), py::arg("max_updates"), py::arg("channels"));

  py::class_<Mesh, std::shared_ptr<Mesh>>(module, "Mesh")
      .def_property_readonly("points",
                             [](const py::object& self) {
                               const auto& mesh = self.cast<const Mesh&>();
                               return view_of(reinterpret_cast<const double*>(mesh.points.data()), {count(mesh.points), 3}, self);
                             })
      .def_property_readonly("tets",
                             [](const py::object& self) {
                               const auto& mesh = self.cast<const Mesh&>();
                               return view_of(reinterpret_cast<const std::uint32_t*>(mesh.tets.data()), {count(mesh.tets), 4}, self);
                             })
      .def_property_readonly("surface",
                             [](const py::object& self) {
                               const auto& mesh = self.cast<const Mesh&>();
                               return view_of(reinterpret_cast<const std::uint8_t*>(mesh.surface.data()), {count(mesh.surface)}, self);
                             })
      .def_property_readonly("value",
                             [](const py::object& self) {
                               const auto& mesh = self.cast<const Mesh&>();
                               return view_of(mesh.value.data(), {count(mesh.value)}, self);
                             })
      .def_property_readonly("part",
                             [](const py::object& self) -> py::object {
                               const auto& mesh = self.cast<const Mesh&>();
                               if (mesh.part.empty()) return py::none();
                               return view_of(mesh.part.data(), {count(mesh.part)}, self);
                             })
      .def_property_readonly("channels", &channels_of)
      .def_property_readonly("volume", &volume_of)
      .def_property_readonly("digest", &mesh_digest)
      .def("_boundary", &boundary_of)
      .def(
          "save", [](const Mesh& mesh, const std::filesystem::path& path) { value_of(write_mesh(path, mesh), Kind::system); }, py::arg("path"),
          Release());
}

}  // namespace intervale::python
