// The Python module intervale._intervale: thin bindings of the installed C++ libraries. What is convenient is Python's
// (intervale/*.py).
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>

#include "intervale/mesh.h"
#include "intervale/result.h"

namespace intervale::python {

namespace py = pybind11;

// The value of a result; an error becomes an exception: of wrong usage ValueError, else of this kind.
enum class Kind { format, connection, system };
[[noreturn]] void raise(const Error& error, Kind kind);
template <class T>
T value_of(Result<T> result, Kind kind) {
  if (!result) raise(result.error(), kind);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

// A read-only array over memory that `owner` keeps.
template <class T>
py::array view_of(const T* data, std::vector<py::ssize_t> shape, const py::object& owner) {
  py::array_t<T> array(std::move(shape), data, owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}

using SharedMesh = std::shared_ptr<const Mesh>;
// Meshes are never changed; the pointer is what pybind11 holds.
inline std::shared_ptr<Mesh> held(const SharedMesh& mesh) { return std::const_pointer_cast<Mesh>(mesh); }
inline std::shared_ptr<Mesh> held(Mesh mesh) { return std::make_shared<Mesh>(std::move(mesh)); }

void add_meshes(py::module_& module);
void add_data_sets(py::module_& module);
void add_streams(py::module_& module);

}  // namespace intervale::python
