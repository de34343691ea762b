// SPDX-License-Identifier: GPL-3.0-or-later
// What Python can ask a Scene without rendering it, and the module about itself: rays, bounds, memory, versions, the
// log, and the sampler's points.
#include <OpenImageIO/oiioversion.h>
#include <tbb/version.h>

#include <shared_mutex>

#include "base/log.h"
#include "base/parallel.h"
#include "base/sampler.h"
#include "lights/camera.h"
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

py::array_t<bool> occluded(const PyScene& self, const py::handle& origins, const py::handle& targets, size_t together) {
  if (together < 1 || together > RayCaster::kTogether)
    throw InvalidInput("occluded: together must be 1 to " + std::to_string(RayCaster::kTogether));
  const RayInput in = ray_input(origins, targets, "targets");
  py::array_t<bool> out(static_cast<py::ssize_t>(in.count));
  bool* hidden = out.mutable_data();
  const py::gil_scoped_release free;
  const auto lock = reading(self);
  const std::vector<Ray> rays = rays_of(in, self.core->scene.origin(), true);
  parallel_blocks(in.count, 256 * together, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; i += together) {
      const std::span<const Ray> group = std::span(rays).subspan(i, std::min(end - i, together));
      const uint32_t found = together > 1 ? self.core->rays.occluded(group) : self.core->rays.occluded(rays[i]);
      for (size_t j = 0; j < group.size(); ++j) hidden[i + j] = found >> j & 1;
    }
  });
  return out;
}

template <int n>
struct Rows {  // (N, n) floats of an answer
  py::array_t<float> array;
  float* to;
  explicit Rows(size_t count) : array({py::ssize_t(count), py::ssize_t(n)}), to(array.mutable_data()) {}
  template <class Vector>
  void set(size_t row, const Vector& v) {
    for (int k = 0; k < n; ++k) to[row * n + size_t(k)] = v[k];
  }
};

/// Everything that surface_point and offset_origin say about the closest hits; positions in absolute coordinates.
py::dict surface(const PyScene& self, const py::handle& origins, const py::handle& directions) {
  const RayInput in = ray_input(origins, directions, "directions");
  const auto n = py::ssize_t(in.count);
  Rows<3> face(in.count), normal(in.count);
  Rows<2> uv(in.count);
  py::array_t<double> position({n, py::ssize_t(3)}), above({n, py::ssize_t(3)}), below({n, py::ssize_t(3)});
  py::array_t<uint32_t> material(n);
  py::array_t<bool> backfacing(n), valid(n);
  const auto lock = reading(self);
  const Scene& scene = self.core->scene;
  const std::vector<Ray> rays = rays_of(in, scene.origin(), false);
  for (py::ssize_t i = 0; i < n; ++i) {
    Hit hit;
    SurfacePoint point;
    valid.mutable_at(i) = self.core->rays.closest(rays[size_t(i)], hit);
    if (hit.valid()) point = surface_point(scene, rays[size_t(i)], hit, true);
    face.set(size_t(i), point.face_normal);
    normal.set(size_t(i), point.normal);
    uv.set(size_t(i), point.uv);
    const Vec3 up = offset_origin(point, point.face_normal), down = offset_origin(point, -point.face_normal);
    for (int k = 0; k < 3; ++k) {
      position.mutable_at(i, k) = double(point.position[k]) + scene.origin()[k];
      above.mutable_at(i, k) = double(up[k]) + scene.origin()[k];
      below.mutable_at(i, k) = double(down[k]) + scene.origin()[k];
    }
    material.mutable_at(i) = scene.material_handles()[point.material];
    backfacing.mutable_at(i) = point.backfacing;
  }
  py::dict out;
  out["valid"] = valid;
  out["position"] = position;
  out["above"] = above;
  out["below"] = below;
  out["face_normal"] = face.array;
  out["normal"] = normal.array;
  out["uv"] = uv.array;
  out["material"] = material;
  out["backfacing"] = backfacing;
  return out;
}

/// The committed camera's rays through N places of an image.
py::dict camera_rays(const PyScene& self, const py::handle& pixels, const py::handle& lens, uint32_t width,
                     uint32_t height) {
  const auto at = numbers<float>(pixels, "pixels", 2), on = numbers<float>(lens, "lens", 2);
  const size_t n = size_t(at.shape(0));
  if (on.shape(0) != at.shape(0)) throw InvalidInput("there must be as many lens points as pixels");
  const auto lock = reading(self);
  const Scene& scene = self.core->scene;
  const CameraRays camera(scene.camera(), scene.origin(), width, height);
  Rows<3> origin(n), direction(n), origin_dx(n), origin_dy(n), direction_dx(n), direction_dy(n);
  Rows<2> range(n);
  for (size_t i = 0; i < n; ++i) {
    const CameraRay ray =
        camera.ray({at.data()[2 * i], at.data()[2 * i + 1]}, {on.data()[2 * i], on.data()[2 * i + 1]});
    origin.set(i, ray.ray.origin);
    direction.set(i, ray.ray.direction);
    origin_dx.set(i, ray.origin_dx);
    origin_dy.set(i, ray.origin_dy);
    direction_dx.set(i, ray.direction_dx);
    direction_dy.set(i, ray.direction_dy);
    range.set(i, Vec2(ray.ray.t_min, ray.ray.t_max));
  }
  py::dict out;
  out["origin"] = origin.array;
  out["direction"] = direction.array;
  out["origin_dx"] = origin_dx.array;
  out["origin_dy"] = origin_dy.array;
  out["direction_dx"] = direction_dx.array;
  out["direction_dy"] = direction_dy.array;
  out["range"] = range.array;
  return out;
}

py::dict changes_since(const PyScene& self, uint64_t version) {
  const auto lock = reading(self);
  const SceneChanges c = self.core->scene.changes_since(version);
  std::vector<Handle> moved, deformed;
  for (const MovedInstance& move : c.instances_moved) (move.deformed ? deformed : moved).push_back(move.instance);
  py::dict out;
  out["version"] = c.version;
  for (const auto& [name, flag] : {std::pair("everything", c.everything), std::pair("camera", c.camera),
                                   std::pair("world", c.world), std::pair("origin", c.origin)})
    out[name] = flag;
  const std::pair<const char*, const std::vector<Handle>*> lists[] = {
      {"meshes_added", &c.meshes_added},         {"meshes_deformed", &c.meshes_deformed},
      {"meshes_replaced", &c.meshes_replaced},   {"meshes_removed", &c.meshes_removed},
      {"instances_added", &c.instances_added},   {"instances_removed", &c.instances_removed},
      {"instances_edited", &c.instances_edited}, {"instances_moved", &moved},
      {"instances_deformed", &deformed},         {"materials_added", &c.materials_added},
      {"materials_edited", &c.materials_edited}, {"materials_removed", &c.materials_removed},
      {"lights_added", &c.lights_added},         {"lights_edited", &c.lights_edited},
      {"lights_removed", &c.lights_removed},     {"images_edited", &c.images_edited},
  };
  for (const auto& [name, list] : lists) {
    py::list handles;
    for (const Handle handle : *list) handles.append(handle);
    out[name] = handles;
  }
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
      .def("occluded", &occluded, py::arg("origins"), py::arg("targets"), py::arg("together") = 1)
      .def("surface", &surface, py::arg("origins"), py::arg("directions"))
      .def("camera_rays", &camera_rays, py::arg("pixels"), py::arg("lens"), py::arg("width"), py::arg("height"))
      .def("changes_since", &changes_since, py::arg("version"))
      .def_property_readonly("origin",
                             [](const PyScene& self) {
                               const DVec3 o = self.core->scene.origin();
                               return py::make_tuple(o.x, o.y, o.z);
                             })
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
