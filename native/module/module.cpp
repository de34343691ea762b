// SPDX-License-Identifier: GPL-3.0-or-later
// The Python module: exceptions, and one bind function a subject. Names, numpy, the GIL and exceptions are all that
// lives in this folder; python/afterglow/_native.pyi is its contract.
#include "module/bindings.h"

namespace afterglow {

namespace {

/// A Python exception class below `base` and, where given, a builtin, so that `except ValueError` works, too.
py::object new_exception(py::module_& m, const char* name, const py::object& base, PyObject* builtin = nullptr) {
  const std::string full = std::string("afterglow.") + name;
  // Tuples of one and of two have types of their own since pybind11 3.
  py::tuple bases = py::make_tuple(base);
  if (builtin) bases = py::make_tuple(base, py::reinterpret_borrow<py::object>(builtin));
  PyObject* type = PyErr_NewException(full.c_str(), bases.ptr(), nullptr);
  if (!type) throw py::error_already_set();
  m.attr(name) = py::reinterpret_borrow<py::object>(type);
  return py::reinterpret_steal<py::object>(type);
}

// Exception classes live as long as the process: a translator may run while the module is already being torn down.
struct Exceptions {
  PyObject *error, *input, *handle, *file, *unsupported, *memory, *cancelled;
};
Exceptions exceptions{};

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const InvalidInput& e) {
    PyErr_SetString(exceptions.input, e.what());
  } catch (const InvalidHandle& e) {
    PyErr_SetString(exceptions.handle, e.what());
  } catch (const FileError& e) {
    PyErr_SetString(exceptions.file, e.what());
  } catch (const Unsupported& e) {
    PyErr_SetString(exceptions.unsupported, e.what());
  } catch (const OutOfMemory& e) {
    PyErr_SetString(exceptions.memory, e.what());
  } catch (const Cancelled& e) {
    PyErr_SetString(exceptions.cancelled, e.what());
  } catch (const Error& e) {
    PyErr_SetString(exceptions.error, e.what());
  } catch (const std::bad_alloc&) {
    PyErr_SetString(exceptions.memory,
                    "out of memory: render at a lower resolution, or with smaller meshes and images");
  }
}

void bind_exceptions(py::module_& m) {
  const py::object base = py::reinterpret_borrow<py::object>(PyExc_Exception);
  const py::object error = new_exception(m, "Error", base);
  exceptions = {error.inc_ref().ptr(),
                new_exception(m, "InvalidInput", error, PyExc_ValueError).release().ptr(),
                new_exception(m, "InvalidHandle", error, PyExc_KeyError).release().ptr(),
                new_exception(m, "FileError", error, PyExc_OSError).release().ptr(),
                new_exception(m, "Unsupported", error).release().ptr(),
                new_exception(m, "OutOfMemory", error, PyExc_MemoryError).release().ptr(),
                new_exception(m, "Cancelled", error).release().ptr()};
  py::register_exception_translator(translate);
}

}  // namespace

}  // namespace afterglow

PYBIND11_MODULE(_native, m) {
  m.doc() = "Afterglow's native core: scenes, sessions, and their building blocks.";
  m.attr("__version__") = AFTERGLOW_VERSION;
  afterglow::bind_exceptions(m);
  afterglow::bind_scene(m);
  afterglow::bind_materials(m);
  afterglow::bind_lights(m);
  afterglow::bind_session(m);
}
