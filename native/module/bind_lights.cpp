// SPDX-License-Identifier: GPL-3.0-or-later
// Python's view of light sampling, for tests and researchers: what is chosen from a point, and the density that the
// other side of multiple importance sampling would report.
#include "base/parallel.h"
#include "module/bindings.h"

namespace afterglow {

namespace {

using Array = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// Rows that may be given once for all.
template <class T>
auto rows_of(const py::handle& value, const std::string& what, py::ssize_t& count, py::ssize_t width = 3) {
  auto array = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw InvalidInput(what + " must be an array of numbers");
  }
  if (array.ndim() == 1 && array.shape(0) == width) array = array.reshape({py::ssize_t(1), width});
  if (array.ndim() != 2 || array.shape(1) != width)
    throw InvalidInput(what + " must have the shape (N, " + std::to_string(width) + ")");
  if (array.shape(0) != 1) {
    if (count != 1 && array.shape(0) != count) throw InvalidInput(what + " must have as many rows as the other arrays");
    count = array.shape(0);
  }
  return array;
}

Array table(py::ssize_t rows, py::ssize_t columns) { return columns == 1 ? Array(rows) : Array({rows, columns}); }

void put(float* out, py::ssize_t row, const Vec3& v) {
  out[3 * row] = v.x, out[3 * row + 1] = v.y, out[3 * row + 2] = v.z;
}

template <class T>
const T* row(const py::array_t<T, py::array::c_style | py::array::forcecast>& a, py::ssize_t i) {
  return a.data() + (a.shape(0) == 1 ? 0 : i * a.shape(1));
}

template <class F>
void each(py::ssize_t count, const F& body) {
  parallel_blocks(size_t(count), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) body(py::ssize_t(i));
  });
}

Vec3 relative(const double* p, const DVec3& origin) { return Vec3(DVec3(p[0], p[1], p[2]) - origin); }

py::dict light_sample(const PyScene& scene, const py::object& point, const py::object& normal, const py::object& u) {
  py::ssize_t n = 1;
  const auto points = rows_of<double>(point, "light_sample: point", n);
  const auto normals = rows_of<float>(normal, "light_sample: normal", n);
  const auto numbers = rows_of<float>(u, "light_sample: u", n);
  Array direction = table(n, 3), distance = table(n, 1), radiance = table(n, 3), density = table(n, 1);
  py::array_t<bool> valid(n), delta(n);
  py::array_t<uint32_t> light(n);
  const CommittedScene& core = *scene.core;
  const DVec3 origin = core.scene.origin();
  float *to = direction.mutable_data(), *far = distance.mutable_data(), *shine = radiance.mutable_data(),
        *share = density.mutable_data();
  bool *found = valid.mutable_data(), *is_delta = delta.mutable_data();
  uint32_t* index = light.mutable_data();
  {
    py::gil_scoped_release release;
    each(n, [&](py::ssize_t i) {
      const float *nn = row(normals, i), *uu = row(numbers, i);
      LightSample s;
      found[i] =
          core.lights.sample(relative(row(points, i), origin), Vec3(nn[0], nn[1], nn[2]), uu[0], Vec2(uu[1], uu[2]), s);
      if (!found[i]) s = LightSample{};
      put(to, i, s.direction), put(shine, i, s.radiance);
      far[i] = s.distance, share[i] = s.density, is_delta[i] = s.delta, index[i] = s.light;
    });
  }
  py::dict d;
  d["valid"] = valid, d["direction"] = direction, d["distance"] = distance, d["radiance"] = radiance;
  d["density"] = density, d["delta"] = delta, d["light"] = light;
  return d;
}

/// What a ray meets, as a path tracer's surface sample would: the nearest lamp or emissive triangle, else suns and
/// world.
void follow(const CommittedScene& core, const Ray& ray, const Vec3& normal, float& t, Rgb& radiance, float& density) {
  Hit hit;
  LightHit lamp;
  const bool surface = core.rays.closest(ray, hit);
  t = surface ? hit.t : kInfinity;
  radiance = Rgb(0.0f), density = 0.0f;
  if (core.lights.intersect(ray, lamp) && lamp.t < t) {
    t = lamp.t, radiance = lamp.radiance;
    density = core.lights.density_of_light(ray.origin, normal, ray.direction, lamp);
    return;
  }
  const PathContext context{0, 0, 0, 0, 0, 0, 0.0f, false, false};
  if (surface) {
    const SurfacePoint point = surface_point(core.scene, ray, hit, true);
    radiance = core.materials.emission(core.scene, point, context);
    density = core.lights.density_of_triangle(ray.origin, normal, point);
    return;
  }
  if (core.materials.has_world()) {
    radiance = core.materials.world(ray.direction, context);
    density = core.lights.density_of_world(ray.origin, normal, ray.direction);
  }
  for (uint32_t i = 0; i < core.lights.sun_count(); ++i) {
    float sun_density;
    radiance += core.lights.escaped_suns(ray.direction, kVisibleAll, i, sun_density, ray.origin, normal);
    density += sun_density;
  }
}

py::dict light_density(const PyScene& scene, const py::object& point, const py::object& normal,
                       const py::object& direction) {
  py::ssize_t n = 1;
  const auto points = rows_of<double>(point, "light_density: point", n);
  const auto normals = rows_of<float>(normal, "light_density: normal", n);
  const auto directions = rows_of<float>(direction, "light_density: direction", n);
  Array distance = table(n, 1), radiance = table(n, 3), density = table(n, 1);
  const CommittedScene& core = *scene.core;
  const DVec3 origin = core.scene.origin();
  float *far = distance.mutable_data(), *shine = radiance.mutable_data(), *share = density.mutable_data();
  {
    py::gil_scoped_release release;
    each(n, [&](py::ssize_t i) {
      const float *nn = row(normals, i), *dd = row(directions, i);
      const Ray ray{relative(row(points, i), origin), 0.0f, Vec3(dd[0], dd[1], dd[2]), kInfinity, kVisibleAll};
      Rgb light;
      follow(core, ray, Vec3(nn[0], nn[1], nn[2]), far[i], light, share[i]);
      put(shine, i, light);
    });
  }
  py::dict d;
  d["distance"] = distance, d["radiance"] = radiance, d["density"] = density;
  return d;
}

}  // namespace

void bind_lights(py::module_& m) {
  m.def("light_sample", light_sample, py::arg("scene"), py::arg("point"), py::arg("normal"), py::arg("u"));
  m.def("light_density", light_density, py::arg("scene"), py::arg("point"), py::arg("normal"), py::arg("direction"));
}

}  // namespace afterglow
