// SPDX-License-Identifier: GPL-3.0-or-later
// What the module's files share: one bind function a subject, and the ways from Python's values to ours. All argument
// errors become InvalidInput that names the object and the array.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/math.h"
#include "scene/tables.h"
#include "transport/committed_scene.h"

namespace afterglow {

namespace py = pybind11;

void bind_scene(py::module_&);      // Scene, versions, set_log, sobol, measure_rays
void bind_session(py::module_&);    // Session, method_descriptions, denoisers, denoise
void bind_materials(py::module_&);  // bsdf_evaluate, bsdf_sample, evaluate_graph
void bind_lights(py::module_&);     // light_sample

/// Python's Scene: a handle on a committed scene that Sessions share.
struct PyScene {
  std::shared_ptr<CommittedScene> core = std::make_shared<CommittedScene>();
  RayCaster::Options options{};
};

/// The exclusive right to change a scene, or Error when a Session is rendering it.
class EditLock {
 public:
  explicit EditLock(const PyScene& scene) : lock_(scene.core->use, std::try_to_lock) {
    if (!lock_.owns_lock())
      throw Error("the scene is being rendered: edit it inside `with session.edit()`, or cancel the session first");
  }

 private:
  std::unique_lock<std::shared_mutex> lock_;
};

/// A node graph (python/afterglow/_native.pyi). owner names it in errors: "material 'Wood'".
Graph graph_from_python(const py::handle& graph, const std::string& owner);

/// An array of Python as C-contiguous values of T with the given width (1: flat); strided and other-typed arrays are
/// copied once. `what` names it in errors: "mesh 'Cube': positions". Throws InvalidInput for wrong shapes and types.
template <class T>
py::array_t<T, py::array::c_style | py::array::forcecast> numbers(const py::handle& value, const std::string& what,
                                                                  py::ssize_t width) {
  auto array = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw InvalidInput(what + " must be an array of numbers");
  }
  const bool flat = array.ndim() == 1 && width == 1;
  const bool table = array.ndim() == 2 && array.shape(1) == width;
  if (!flat && !table)
    throw InvalidInput(
        what + (width == 1 ? " must be a flat array (N,)" : " must have the shape (N, " + std::to_string(width) + ")"));
  return array;
}

/// A 4 × 4 row-major matrix, as numpy and Blender have them.
DMat4 matrix_from_python(const py::handle& value, const std::string& what);
/// N of them: (N, 4, 4), or one (4, 4).
std::vector<DMat4> matrices_from_python(const py::handle& value, const std::string& what);

}  // namespace afterglow
