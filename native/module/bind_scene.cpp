// SPDX-License-Identifier: GPL-3.0-or-later
// The class Scene of python/afterglow/_native.pyi: edits by handle. Its questions (intersect, bounds, …) are in
// bind_queries.cpp.
#include "module/bindings.h"
#include "module/mesh_from_python.h"
#include "module/queries.h"
#include "module/tables_from_python.h"

namespace afterglow {

namespace {

py::dict effects_of(const Effects& effects) {
  constexpr std::pair<const char*, uint32_t> names[] = {
      {"textures", kTextures},
      {"glossy", kGlossy},
      {"transmission", kTransmission},
      {"transparency", kTransparency},
      {"emissive_mesh", kEmissiveMesh},
      {"punctual_lights", kPunctualLights},
      {"world", kWorldConstant | kWorldVarying},
      {"world_constant", kWorldConstant},
      {"world_varying", kWorldVarying},
      {"many_lights", kManyLights},
      {"depth_of_field", kDepthOfField},
      {"ray_visibility", kRayVisibility},
  };
  py::dict out;
  for (const auto& [name, bits] : names) out[name] = bool(effects.bits & bits);
  return out;
}

py::dict changes_of(const SceneChanges& changes, const CommittedScene& scene) {
  py::dict out;
  out["version"] = changes.version;
  out["effects"] = effects_of(scene.effects);
  out["meshes"] = changes.meshes_added.size() + changes.meshes_deformed.size() + changes.meshes_replaced.size() +
                  changes.meshes_removed.size();
  out["instances"] = changes.instances_added.size() + changes.instances_moved.size() + changes.instances_edited.size() +
                     changes.instances_removed.size();
  out["materials"] =
      changes.materials_added.size() + changes.materials_edited.size() + changes.materials_removed.size();
  out["lights"] = changes.lights_added.size() + changes.lights_edited.size() + changes.lights_removed.size();
  out["everything"] = changes.everything;
  py::list warnings;
  for (const std::string& text : changes.warnings) warnings.append(py::str(text));
  out["warnings"] = warnings;
  out["seconds"] = scene.commit_seconds;
  return out;
}

RayCaster::Flatten flatten_from(const py::object& value) {
  if (py::isinstance<py::str>(value) && value.cast<std::string>() == "still") return RayCaster::Flatten::kStill;
  if (py::isinstance<py::bool_>(value))
    return value.cast<bool>() ? RayCaster::Flatten::kAlways : RayCaster::Flatten::kNever;
  throw InvalidInput("commit: flatten must be True, False, \"still\" or None");
}

py::dict commit(PyScene& self, py::object flatten) {
  const EditLock lock(self);
  if (!flatten.is_none()) self.options.flatten = flatten_from(flatten);
  SceneChanges changes;
  {
    const py::gil_scoped_release free;
    changes = self.core->commit(self.options);
  }
  return changes_of(changes, *self.core);
}

Handle add_mesh(PyScene& self, const py::kwargs& arguments) {
  expect_keywords(
      arguments,
      {"name", "positions", "triangles", "corners", "corner_vertices", "corner_normals", "vertex_normals", "smooth",
       "faces", "materials", "uvs", "active_uv", "attributes", "active_color", "previous_positions"},
      "add_mesh");
  if (!arguments.contains("name")) throw InvalidInput("add_mesh: name is missing");
  const EditLock lock(self);
  Mesh mesh = mesh_from_python(arguments, py::str(arguments["name"]).cast<std::string>());
  const py::gil_scoped_release free;
  return self.core->scene.add_mesh(std::move(mesh));
}

void set_mesh(PyScene& self, Handle handle, const py::kwargs& arguments) {
  const EditLock lock(self);
  Scene& scene = self.core->scene;
  const std::string name =
      arguments.contains("name") ? py::str(arguments["name"]).cast<std::string>() : scene.mesh(handle).name;
  if (only_deforms(arguments)) {
    Deformation d = deformation_from_python(arguments, name);
    const py::gil_scoped_release free;
    scene.deform_mesh(handle, std::move(d.positions), std::move(d.corner_normals), std::move(d.vertex_normals));
    return;
  }
  expect_keywords(
      arguments,
      {"name", "positions", "triangles", "corners", "corner_vertices", "corner_normals", "vertex_normals", "smooth",
       "faces", "materials", "uvs", "active_uv", "attributes", "active_color", "previous_positions"},
      "set_mesh");
  Mesh mesh = mesh_from_python(arguments, name);
  const py::gil_scoped_release free;
  scene.set_mesh(handle, std::move(mesh));
}

using Handles = py::array_t<uint32_t, py::array::c_style | py::array::forcecast>;

/// What differs from instance to instance of one call.
struct Each {
  std::vector<DMat4> transforms, previous;
  std::vector<float> randoms;
};

Each read_each(const py::dict& arguments, size_t count, const std::string& owner) {
  Each each;
  const auto expect = [&](size_t size, const char* name) {
    if (size != count)
      throw InvalidInput(owner + ": " + name + " has " + std::to_string(size) + " entries for " +
                         std::to_string(count) + " instances");
  };
  if (arguments.contains("transforms") && !arguments["transforms"].is_none()) {
    each.transforms = matrices_from_python(arguments["transforms"], owner + ": transforms");
    expect(each.transforms.size(), "transforms");
  }
  if (arguments.contains("previous") && !arguments["previous"].is_none()) {
    each.previous = matrices_from_python(arguments["previous"], owner + ": previous");
    expect(each.previous.size(), "previous");
  }
  if (arguments.contains("randoms") && !arguments["randoms"].is_none()) {
    const auto array = numbers<float>(arguments["randoms"], owner + ": randoms", 1);
    each.randoms.assign(array.data(), array.data() + array.size());
    expect(each.randoms.size(), "randoms");
  }
  return each;
}

py::array_t<uint32_t> add_instances(PyScene& self, Handle mesh, const py::handle& transforms,
                                    const py::kwargs& arguments) {
  expect_keywords(
      arguments,
      {"name", "materials", "object_index", "visibility", "holdout", "shadow_catcher", "color", "randoms", "previous"},
      "add_instances");
  const EditLock lock(self);
  Instance shared;
  read_instance(shared, arguments);
  shared.mesh = mesh;
  const std::string owner = "object '" + shared.name + "'";
  std::vector<DMat4> places = matrices_from_python(transforms, owner + ": transforms");
  const Each each = read_each(arguments, places.size(), owner);
  py::array_t<uint32_t> handles(static_cast<py::ssize_t>(places.size()));
  for (size_t i = 0; i < places.size(); ++i) {
    Instance instance = shared;
    instance.transform = places[i];
    if (!each.previous.empty()) instance.previous = each.previous[i];
    if (!each.randoms.empty()) instance.random = each.randoms[i];
    handles.mutable_at(py::ssize_t(i)) = self.core->scene.add_instance(std::move(instance));
  }
  return handles;
}

void set_transforms(PyScene& self, const Handles& handles, const py::handle& transforms) {
  const EditLock lock(self);
  const std::vector<DMat4> places = matrices_from_python(transforms, "set_transforms: transforms");
  if (size_t(handles.size()) != places.size())
    throw InvalidInput("set_transforms: " + std::to_string(places.size()) + " transforms for " +
                       std::to_string(handles.size()) + " instances");
  for (size_t i = 0; i < places.size(); ++i) self.core->scene.instance(handles.data()[i]);  // all or none
  for (size_t i = 0; i < places.size(); ++i) self.core->scene.set_transform(handles.data()[i], places[i]);
}

void set_instances(PyScene& self, const Handles& handles, const py::kwargs& arguments) {
  expect_keywords(arguments,
                  {"mesh", "transforms", "name", "materials", "object_index", "visibility", "holdout", "shadow_catcher",
                   "color", "randoms", "previous"},
                  "set_instances");
  const EditLock lock(self);
  const Each each = read_each(arguments, size_t(handles.size()), "set_instances");
  for (py::ssize_t i = 0; i < handles.size(); ++i) self.core->scene.instance(handles.data()[i]);
  for (size_t i = 0; i < size_t(handles.size()); ++i) {
    const Handle handle = handles.data()[i];
    Instance instance = self.core->scene.instance(handle);
    read_instance(instance, arguments);
    if (!each.transforms.empty()) instance.transform = each.transforms[i];
    if (!each.previous.empty()) instance.previous = each.previous[i];
    if (!each.randoms.empty()) instance.random = each.randoms[i];
    self.core->scene.set_instance(handle, std::move(instance));
  }
}

void remove_instances(PyScene& self, const Handles& handles) {
  const EditLock lock(self);
  for (py::ssize_t i = 0; i < handles.size(); ++i) self.core->scene.instance(handles.data()[i]);
  for (py::ssize_t i = 0; i < handles.size(); ++i) self.core->scene.remove_instance(handles.data()[i]);
}

void bind_objects(py::class_<PyScene, std::shared_ptr<PyScene>>& scene) {
  scene.def("add_mesh", &add_mesh)
      .def("set_mesh", &set_mesh)
      .def("remove_mesh",
           [](PyScene& self, Handle handle) {
             const EditLock lock(self);
             self.core->scene.remove_mesh(handle);
           })
      .def("add_instances", &add_instances, py::arg("mesh"), py::arg("transforms"))
      .def("set_transforms", &set_transforms, py::arg("instances"), py::arg("transforms"))
      .def("set_instances", &set_instances, py::arg("instances"))
      .def("remove_instances", &remove_instances);
}

void bind_images_and_materials(py::class_<PyScene, std::shared_ptr<PyScene>>& scene) {
  scene
      .def(
          "add_image",
          [](PyScene& self, const py::object& source, const py::kwargs& arguments) {
            const EditLock lock(self);
            Image image;
            read_image(image, source, arguments);
            return self.core->scene.add_image(std::move(image));
          },
          py::arg("source"))
      .def(
          "set_image",
          [](PyScene& self, Handle handle, const py::object& source, const py::kwargs& arguments) {
            const EditLock lock(self);
            Image image = self.core->scene.image(handle);
            read_image(image, source, arguments);
            self.core->scene.set_image(handle, std::move(image));
          },
          py::arg("image"), py::arg("source"))
      .def("remove_image",
           [](PyScene& self, Handle handle) {
             const EditLock lock(self);
             self.core->scene.remove_image(handle);
           })
      .def(
          "add_material",
          [](PyScene& self, const py::object& graph, const py::kwargs& arguments) {
            const EditLock lock(self);
            Material material;
            read_material(material, graph, arguments);
            return self.core->scene.add_material(std::move(material));
          },
          py::arg("graph"))
      .def(
          "set_material",
          [](PyScene& self, Handle handle, const py::object& graph, const py::kwargs& arguments) {
            const EditLock lock(self);
            if (handle == 0) throw InvalidHandle("no material has the handle 0");
            Material material = self.core->scene.material(handle);
            read_material(material, graph, arguments);
            self.core->scene.set_material(handle, std::move(material));
          },
          py::arg("material"), py::arg("graph"))
      .def("remove_material", [](PyScene& self, Handle handle) {
        const EditLock lock(self);
        self.core->scene.remove_material(handle);
      });
}

void bind_lights_and_view(py::class_<PyScene, std::shared_ptr<PyScene>>& scene) {
  scene
      .def(
          "add_light",
          [](PyScene& self, const py::object& kind, const py::object& transform, py::kwargs arguments) {
            const EditLock lock(self);
            arguments["kind"] = kind;
            arguments["transform"] = transform;
            Light light;
            read_light(light, arguments);
            return self.core->scene.add_light(std::move(light));
          },
          py::arg("kind"), py::arg("transform"))
      .def(
          "set_light",
          [](PyScene& self, Handle handle, const py::kwargs& arguments) {
            const EditLock lock(self);
            Light light = self.core->scene.light(handle);
            read_light(light, arguments);
            self.core->scene.set_light(handle, std::move(light));
          },
          py::arg("light"))
      .def("remove_light",
           [](PyScene& self, Handle handle) {
             const EditLock lock(self);
             self.core->scene.remove_light(handle);
           })
      .def(
          "set_world",
          [](PyScene& self, const py::object& graph, const py::kwargs& arguments) {
            const EditLock lock(self);
            World world;
            read_world(world, graph, arguments);
            self.core->scene.set_world(std::move(world));
          },
          py::arg("graph"))
      .def(
          "set_camera",
          [](PyScene& self, const py::object& kind, const py::object& transform, py::kwargs arguments) {
            const EditLock lock(self);
            arguments["kind"] = kind;
            arguments["transform"] = transform;
            Camera camera;
            read_camera(camera, arguments);
            self.core->scene.set_camera(std::move(camera));
          },
          py::arg("kind"), py::arg("transform"));
}

}  // namespace

void bind_scene(py::module_& m) {
  m.attr("CAMERA") = uint32_t(kVisibleCamera);
  m.attr("DIFFUSE") = uint32_t(kVisibleDiffuse);
  m.attr("GLOSSY") = uint32_t(kVisibleGlossy);
  m.attr("TRANSMISSION") = uint32_t(kVisibleTransmission);
  m.attr("SHADOW") = uint32_t(kVisibleShadow);
  m.attr("VOLUME") = uint32_t(kVisibleVolume);
  m.attr("ALL_RAYS") = uint32_t(kVisibleAll);
  py::class_<PyScene, std::shared_ptr<PyScene>> scene(m, "Scene");
  scene.def(py::init<>()).def("commit", &commit, py::arg("flatten") = py::none());
  bind_objects(scene);
  bind_images_and_materials(scene);
  bind_lights_and_view(scene);
  bind_queries(m, scene);
  bind_cells(m);
}

}  // namespace afterglow
