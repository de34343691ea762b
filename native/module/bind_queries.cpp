// SPDX-License-Identifier: GPL-3.0-or-later
// What Python can ask a Scene without rendering it, and the module about itself: rays, bounds, memory, versions, the
// log, and the sampler's points.
#include <OpenImageIO/oiioversion.h>
#include <tbb/version.h>

#include <shared_mutex>

#include "base/log.h"
#include "base/parallel.h"
#include "base/sampler.h"
#include "module/queries.h"
#include "rays/measure_rays.h"
#include "rays/surface_point.h"

namespace afterglow {

namespace {

using Points = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Readers of a committed scene stand back while someone edits it.
std::shared_lock<std::shared_mutex> reading(const PyScene& scene) {
  return std::shared_lock<std::shared_mutex>(scene.core->use);
}

Vec3 relative(const double* p, const DVec3& origin) { return Vec3(DVec3(p[0], p[1], p[2]) - origin); }

struct RayInput {
  Points origins, others;
  size_t count;
};

RayInput ray_input(const py::handle& origins, const py::handle& others, const char* name) {
  RayInput in{numbers<double>(origins, "origins", 3), numbers<double>(others, name, 3), 0};
  in.count = size_t(in.origins.shape(0));
  if (in.others.shape(0) != in.origins.shape(0))
    throw InvalidInput(std::string("there are ") + std::to_string(in.count) + " origins and " +
                       std::to_string(in.others.shape(0)) + " " + name);
  return in;
}

std::vector<Ray> rays_of(const RayInput& in, const DVec3& origin, bool targets) {
  std::vector<Ray> rays(in.count);
  for (size_t i = 0; i < in.count; ++i) {
    const double *a = in.origins.data() + 3 * i, *b = in.others.data() + 3 * i;
    const DVec3 way = targets ? DVec3(b[0] - a[0], b[1] - a[1], b[2] - a[2]) : DVec3(b[0], b[1], b[2]);
    const double length = glm::length(way);
    rays[i].origin = relative(a, origin);
    rays[i].direction = Vec3(way / length);  // no direction: not finite, hits nothing
    if (targets) rays[i].t_max = float(length * (1.0 - 1e-5));
  }
  return rays;
}

py::dict intersect(const PyScene& self, const py::handle& origins, const py::handle& directions) {
  const RayInput in = ray_input(origins, directions, "directions");
  const auto n = py::ssize_t(in.count);
  py::array_t<float> distance(n), barycentric({n, py::ssize_t(2)}), normal({n, py::ssize_t(3)});
  py::array_t<uint32_t> instance(n);
  py::array_t<int32_t> triangle(n);
  float *t = distance.mutable_data(), *uv = barycentric.mutable_data(), *normals = normal.mutable_data();
  uint32_t* instances = instance.mutable_data();
  int32_t* triangles = triangle.mutable_data();
  {
    const py::gil_scoped_release free;
    const auto lock = reading(self);
    const Scene& scene = self.core->scene;
    const std::vector<Ray> rays = rays_of(in, scene.origin(), false);
    parallel_blocks(in.count, 4096, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        Hit hit;
        Vec3 face(0.0f);
        const bool found = self.core->rays.closest(rays[i], hit);
        if (found) face = surface_point(scene, rays[i], hit, false).normal;
        t[i] = hit.t;
        uv[2 * i] = found ? hit.u : 0.0f;
        uv[2 * i + 1] = found ? hit.v : 0.0f;
        for (size_t k = 0; k < 3; ++k) normals[3 * i + k] = face[int(k)];
        instances[i] = found ? scene.instances()[hit.instance].handle : 0;
        triangles[i] = found ? int32_t(hit.triangle) : -1;
      }
    });
  }
  py::dict out;
  out["distance"] = distance;
  out["instance"] = instance;
  out["triangle"] = triangle;
  out["barycentric"] = barycentric;
  out["normal"] = normal;
  return out;
}

py::array_t<bool> occluded(const PyScene& self, const py::handle& origins, const py::handle& targets) {
  const RayInput in = ray_input(origins, targets, "targets");
  py::array_t<bool> out(static_cast<py::ssize_t>(in.count));
  bool* hidden = out.mutable_data();
  const py::gil_scoped_release free;
  const auto lock = reading(self);
  const std::vector<Ray> rays = rays_of(in, self.core->scene.origin(), true);
  parallel_blocks(in.count, 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) hidden[i] = self.core->rays.occluded(rays[i]);
  });
  return out;
}

py::dict measure(const PyScene& self, const py::handle& origins, const py::handle& directions, const std::string& kind,
                 int rounds) {
  if (kind != "closest" && kind != "occluded")
    throw InvalidInput("measure_rays: kind must be 'closest' or 'occluded' (then directions are targets)");
  const bool occlusion = kind == "occluded";
  const RayInput in = ray_input(origins, directions, occlusion ? "targets" : "directions");
  RayTimings timings;
  {
    const py::gil_scoped_release free;
    const auto lock = reading(self);
    timings = measure_rays(self.core->rays, rays_of(in, self.core->scene.origin(), occlusion), occlusion, rounds);
  }
  py::dict out;
  out["wrapped"] = py::array_t<double>(py::ssize_t(timings.wrapped.size()), timings.wrapped.data());
  out["bare"] = py::array_t<double>(py::ssize_t(timings.bare.size()), timings.bare.data());
  out["hits_wrapped"] = timings.hits_wrapped;
  out["hits_bare"] = timings.hits_bare;
  return out;
}

py::object bounds(const PyScene& self) {
  const auto lock = reading(self);
  const Box box = self.core->scene.bounds();
  const DVec3 origin = self.core->scene.origin();
  if (box.empty()) return py::make_tuple(py::make_tuple(0.0, 0.0, 0.0), py::make_tuple(0.0, 0.0, 0.0));
  const DVec3 lower = DVec3(box.lower) + origin, upper = DVec3(box.upper) + origin;
  return py::make_tuple(py::make_tuple(lower.x, lower.y, lower.z), py::make_tuple(upper.x, upper.y, upper.z));
}

py::dict bytes(const PyScene& self) {
  const auto lock = reading(self);
  py::dict out;
  for (const auto& [table, size] : self.core->scene.bytes()) out[py::str(table)] = size;
  out["bvh"] = self.core->rays.bytes();
  out["materials"] = self.core->materials.bytes();
  out["lights"] = self.core->lights.bytes();
  return out;
}

py::dict versions() {
  py::dict out;
  out["afterglow"] = AFTERGLOW_VERSION;
  out["embree"] = ray_library_version();
  out["tbb"] = std::to_string(TBB_VERSION_MAJOR) + "." + std::to_string(TBB_VERSION_MINOR);
  out["openimageio"] = OIIO_VERSION_STRING;
  out["pybind11"] = std::to_string(PYBIND11_VERSION_MAJOR) + "." + std::to_string(PYBIND11_VERSION_MINOR) + "." +
                    PYBIND11_TOSTRING(PYBIND11_VERSION_PATCH);
#if defined(__clang__)
  out["compiler"] = "clang " __clang_version__;
#else
  out["compiler"] = "gcc " __VERSION__;
#endif
  return out;
}

void set_log(const py::object& sink) {
  if (sink.is_none()) return set_log_sink(nullptr);
  if (!PyCallable_Check(sink.ptr())) throw InvalidInput("set_log: the sink must be callable, or None");
  // Released with the GIL, or never when Python has ended before.
  std::shared_ptr<PyObject> held(sink.inc_ref().ptr(), [](PyObject* object) {
    if (!Py_IsInitialized()) return;
    const py::gil_scoped_acquire gil;
    Py_DECREF(object);
  });
  set_log_sink([held](const std::string& level, const std::string& text) {
    if (!Py_IsInitialized()) return;
    const py::gil_scoped_acquire gil;
    PyObject* answer = PyObject_CallFunction(held.get(), "ss", level.c_str(), text.c_str());
    if (answer)
      Py_DECREF(answer);
    else
      PyErr_WriteUnraisable(held.get());
  });
}

py::array_t<float> sobol_points(py::ssize_t count, py::ssize_t dimensions, uint32_t seed) {
  if (count < 0 || dimensions < 0) throw InvalidInput("sobol: count and dimensions must not be negative");
  py::array_t<float> out({count, dimensions});
  float* to = out.mutable_data();
  const py::gil_scoped_release free;
  for (py::ssize_t i = 0; i < count; ++i) {
    Sampler sampler(seed, uint32_t(i));
    for (py::ssize_t d = 0; d < dimensions; ++d) *to++ = sampler.next1();
  }
  return out;
}

}  // namespace

void bind_queries(py::module_& m, py::class_<PyScene, std::shared_ptr<PyScene>>& scene) {
  scene.def("intersect", &intersect, py::arg("origins"), py::arg("directions"))
      .def("occluded", &occluded, py::arg("origins"), py::arg("targets"))
      .def_property_readonly("version", [](const PyScene& self) { return self.core->scene.version(); })
      .def_property_readonly("bounds", &bounds)
      .def_property_readonly("bytes", &bytes);
  m.def("measure_rays", &measure, py::arg("scene"), py::arg("origins"), py::arg("directions"),
        py::arg("kind") = "closest", py::arg("rounds") = 8);
  m.def("versions", &versions);
  m.def("set_log", &set_log, py::arg("sink"));
  m.def("sobol", &sobol_points, py::arg("count"), py::arg("dimensions"), py::arg("seed"));
}

}  // namespace afterglow
