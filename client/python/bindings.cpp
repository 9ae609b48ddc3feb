#include "client/python/bindings.h"

namespace intervale::python {

void raise(const Error& error, Kind kind) {
  const py::gil_scoped_acquire lock;
  PyObject* type = PyExc_OSError;
  if (error.usage) {
    type = PyExc_ValueError;
  } else if (kind == Kind::connection) {
    type = PyExc_ConnectionError;
  } else if (kind == Kind::format) {
    type = py::module_::import("intervale._intervale").attr("FormatError").ptr();
  }
  PyErr_SetString(type, error.message.c_str());
  throw py::error_already_set();
}

PYBIND11_MODULE(_intervale, module) {
  module.attr("__version__") = INTERVALE_VERSION;
  py::register_exception<std::bad_alloc>(module, "NoMemory", PyExc_MemoryError);
  module.attr("FormatError") = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc(
      "intervale.FormatError", "A file, or what a server sent, is damaged or not what it should be.", PyExc_ValueError, nullptr));
  add_meshes(module);
  add_data_sets(module);
  add_streams(module);
}

}  // namespace intervale::python
