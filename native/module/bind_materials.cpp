// SPDX-License-Identifier: GPL-3.0-or-later
// The building blocks of materials for tests and researchers: BSDFs and node graphs by themselves, without a scene.
#include <pybind11/stl.h>

#include "materials/standalone.h"
#include "module/bindings.h"

namespace afterglow {

namespace {

using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

Floats vectors(py::ssize_t count, py::ssize_t width) { return Floats(std::vector<py::ssize_t>{count, width}); }

Vec3 vector_at(const Floats& array, py::ssize_t row) {
  const float* v = array.data() + (array.shape(0) == 1 ? 0 : 3 * row);
  return {v[0], v[1], v[2]};
}

void store(Floats& array, py::ssize_t row, const Vec3& v) {
  float* out = array.mutable_data() + 3 * row;
  out[0] = v.x, out[1] = v.y, out[2] = v.z;
}

Vec3 unit(const Vec3& v) {
  const float length = glm::length(v);
  return length > 0.0f ? v / length : Vec3(0, 0, 1);
}

/// The point of a BSDF test: z is the normal; backfacing, kind of path and the like by keyword.
PointSetup setup_from(const py::kwargs& options) {
  PointSetup setup;
  for (const auto& [key, value] : options) {
    const std::string name = py::str(key);
    if (name == "backfacing")
      setup.backfacing = value.cast<bool>();
    else if (name == "drop_glossy")
      setup.drop_glossy = value.cast<bool>();
    else if (name == "drop_refractive")
      setup.drop_refractive = value.cast<bool>();
    else if (name == "fold")
      setup.fold = value.cast<bool>();
    else if (name == "kind")
      setup.kind = value.cast<uint32_t>();
    else if (name == "diffuse_only")
      setup.diffuse_only = value.cast<bool>();
    else
      throw InvalidInput("unknown keyword \"" + name + "\"");
  }
  return setup;
}

py::tuple bsdf_evaluate(const py::handle& graph, const py::handle& wo, const py::handle& wi,
                        const py::kwargs& options) {
  const Standalone material(graph_from_python(graph, "graph"), setup_from(options));
  const Floats o = numbers<float>(wo, "wo", 3), i = numbers<float>(wi, "wi", 3);
  const py::ssize_t count = std::max(o.shape(0), i.shape(0));
  if ((o.shape(0) != count && o.shape(0) != 1) || (i.shape(0) != count && i.shape(0) != 1)) {
    throw InvalidInput("wo and wi must have as many rows, or one");
  }
  Floats value = vectors(count, 3), density(count);
  float* densities = density.mutable_data();
  for (py::ssize_t k = 0; k < count; ++k) {
    const BsdfValue v = material.evaluate(unit(vector_at(o, k)), unit(vector_at(i, k)));
    store(value, k, v.total());
    densities[k] = v.density;
  }
  return py::make_tuple(value, density);
}

py::dict bsdf_sample(const py::handle& graph, const py::handle& wo, const py::handle& numbers_in,
                     const py::kwargs& options) {
  const Standalone material(graph_from_python(graph, "graph"), setup_from(options));
  const Floats o = numbers<float>(wo, "wo", 3), u = numbers<float>(numbers_in, "u", 3);
  const py::ssize_t count = u.shape(0);
  if (o.shape(0) != count && o.shape(0) != 1) throw InvalidInput("wo must have as many rows as u, or one");
  Floats direction = vectors(count, 3), value = vectors(count, 3), density(count), roughness(count);
  py::array_t<bool> delta(count), transmitted(count), valid(count);
  py::array_t<uint8_t> pass(count);
  for (py::ssize_t k = 0; k < count; ++k) {
    const Vec3 x = vector_at(u, k);
    const BsdfSample s = material.sample(unit(vector_at(o, k)), x.x, {x.y, x.z});
    store(direction, k, s.direction);
    store(value, k, s.valid ? s.value.total() : Rgb(0.0f));
    density.mutable_data()[k] = s.valid ? s.value.density : 0.0f;
    roughness.mutable_data()[k] = s.roughness;
    delta.mutable_data()[k] = s.delta, transmitted.mutable_data()[k] = s.transmitted, valid.mutable_data()[k] = s.valid;
    pass.mutable_data()[k] = uint8_t(s.pass);
  }
  py::dict result;
  result["direction"] = direction, result["value"] = value, result["density"] = density, result["delta"] = delta;
  result["transmitted"] = transmitted, result["valid"] = valid, result["pass"] = pass, result["roughness"] = roughness;
  return result;
}

py::dict evaluate_graph(const py::handle& graph, const py::dict& points, const py::kwargs& options) {
  const Standalone material(graph_from_python(graph, "graph"), setup_from(options));
  py::ssize_t count = 1;
  std::vector<std::pair<std::string, Floats>> arrays;
  for (const auto& [key, value] : points) {
    const std::string name = py::str(key);
    if (name != "position" && name != "normal" && name != "face_normal" && name != "incoming" && name != "uv") {
      throw InvalidInput("points: unknown array \"" + name + "\" (position, normal, face_normal, incoming, uv)");
    }
    arrays.emplace_back(name, numbers<float>(value, "points: " + name, name == "uv" ? 2 : 3));
    count = std::max(count, arrays.back().second.shape(0));
  }
  const char* names[] = {"emission", "transparency", "diffuse", "glossy", "transmission", "normal"};
  std::vector<Floats> out;
  for (int k = 0; k < 6; ++k) out.push_back(vectors(count, 3));
  py::array_t<int32_t> lobes(count);
  for (py::ssize_t k = 0; k < count; ++k) {
    SurfacePoint point{{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    for (const auto& [name, array] : arrays) {
      const float* v = array.data() + (array.shape(0) == 1 ? 0 : array.shape(1) * k);
      if (name == "uv")
        point.uv = {v[0], v[1]};
      else if (name == "position")
        point.position = {v[0], v[1], v[2]};
      else if (name == "normal")
        point.normal = unit({v[0], v[1], v[2]});
      else if (name == "face_normal")
        point.face_normal = unit({v[0], v[1], v[2]});
      else
        point.outgoing = unit({v[0], v[1], v[2]});
    }
    Surface surface;
    material.shade(point, surface);
    const SurfaceAlbedo a = albedo(surface, point.outgoing);
    const Vec3 values[] = {surface.emission, surface.transparency,
                           a.diffuse,        a.glossy,
                           a.transmission,   surface.count ? surface.lobes[0].normal : point.normal};
    for (int n = 0; n < 6; ++n) store(out[size_t(n)], k, values[n]);
    lobes.mutable_data()[k] = surface.count;
  }
  py::dict result;
  for (int n = 0; n < 6; ++n) result[names[n]] = out[size_t(n)];
  result["lobes"] = lobes;
  result["warnings"] = material.warnings();
  result["folded"] = material.folded();
  result["instructions"] = material.instructions();
  return result;
}

}  // namespace

void bind_materials(py::module_& m) {
  m.def("bsdf_evaluate", &bsdf_evaluate, py::arg("graph"), py::arg("wo"), py::arg("wi"));
  m.def("bsdf_sample", &bsdf_sample, py::arg("graph"), py::arg("wo"), py::arg("u"));
  m.def("evaluate_graph", &evaluate_graph, py::arg("graph"), py::arg("points"));
}

}  // namespace afterglow
