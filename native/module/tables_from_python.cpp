// SPDX-License-Identifier: GPL-3.0-or-later
// Keyword arguments to rows of the scene's tables: see tables_from_python.h.
#include "module/tables_from_python.h"

#include <algorithm>
#include <array>

#include "module/arrays.h"

namespace afterglow {

namespace {

/// Calls use(value) when the keyword is there and not None; a wrong type becomes InvalidInput.
template <class T, class Use>
void given(const py::dict& arguments, const char* name, const std::string& owner, const Use& use) {
  if (!arguments.contains(name)) return;
  const py::object value = arguments[name];
  if (value.is_none()) return;
  try {
    use(value.cast<T>());
  } catch (const py::cast_error&) {
    throw InvalidInput(owner + ": " + name + " has a wrong type (" + py::str(py::type::of(value)).cast<std::string>() +
                       ")");
  }
}

template <class T>
void set(T& to, const py::dict& arguments, const char* name, const std::string& owner) {
  given<T>(arguments, name, owner, [&](T value) { to = std::move(value); });
}

/// A finite float; `least` and above.
void set_number(float& to, const py::dict& arguments, const char* name, const std::string& owner,
                float least = -kInfinity) {
  given<float>(arguments, name, owner, [&](float value) {
    if (!std::isfinite(value) || value < least)
      throw InvalidInput(owner + ": " + name + " is " + std::to_string(value) + ", which is out of range");
    to = value;
  });
}

template <int n, class Vector>
void set_vector(Vector& to, const py::dict& arguments, const char* name, const std::string& owner, bool finite = true) {
  given<py::object>(arguments, name, owner, [&](const py::object& value) {
    if (!PySequence_Check(value.ptr()) || py::len(value) != n)
      throw InvalidInput(owner + ": " + name + " must have " + std::to_string(n) + " numbers");
    for (int k = 0; k < n; ++k) {
      to[k] = value[py::int_(k)].cast<float>();
      if (std::isnan(to[k]) || (finite && !std::isfinite(to[k])))
        throw InvalidInput(owner + ": " + name + "[" + std::to_string(k) + "] is not finite");
    }
  });
}

void set_transform(DMat4& to, const py::dict& arguments, const std::string& owner) {
  if (!arguments.contains("transform") || arguments["transform"].is_none()) return;
  const DMat4 m = matrix_from_python(arguments["transform"], owner + ": transform");
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      if (!std::isfinite(m[column][row])) throw InvalidInput(owner + ": transform is not finite");
  to = m;
}

template <size_t n>
size_t choose(const std::array<const char*, n>& names, const std::string& name, const std::string& owner) {
  for (size_t k = 0; k < n; ++k)
    if (name == names[k]) return k;
  std::string text = owner + ": there is no '" + name + "'; choose one of";
  for (const char* known : names) text += std::string(" ") + known;
  throw InvalidInput(text);
}

std::shared_ptr<ImageSource> pixels_from(const py::array& array, const std::string& owner) {
  auto source = std::make_shared<ImageSource>();
  if ((array.ndim() != 2 && array.ndim() != 3) || (array.ndim() == 3 && (array.shape(2) < 1 || array.shape(2) > 4)))
    throw InvalidInput(owner + ": pixels must have the shape (height, width, 1 to 4)");
  if (array.size() == 0) throw InvalidInput(owner + ": pixels are empty");
  source->height = uint32_t(array.shape(0));
  source->width = uint32_t(array.shape(1));
  source->channels = array.ndim() == 3 ? uint32_t(array.shape(2)) : 1;
  if (py::isinstance<py::array_t<uint8_t>>(array)) {
    auto bytes = py::array_t<uint8_t, py::array::c_style | py::array::forcecast>::ensure(array);
    source->byte_pixels.assign(bytes.data(), bytes.data() + bytes.size());
    return source;
  }
  auto floats = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!floats) {
    PyErr_Clear();
    throw InvalidInput(owner + ": pixels must be float32 or uint8");
  }
  source->pixels.assign(floats.data(), floats.data() + floats.size());
  return source;
}

std::shared_ptr<ImageSource> source_from(const py::handle& value, const std::string& owner) {
  auto source = std::make_shared<ImageSource>();
  if (py::isinstance<py::str>(value)) {
    source->path = value.cast<std::string>();
  } else if (py::hasattr(value, "__fspath__")) {
    source->path = py::str(value.attr("__fspath__")()).cast<std::string>();
  } else if (py::isinstance<py::bytes>(value) || PyByteArray_Check(value.ptr()) || PyMemoryView_Check(value.ptr())) {
    const std::string_view bytes = py::bytes(py::reinterpret_borrow<py::object>(value));
    source->encoded.assign(bytes.begin(), bytes.end());
  } else if (py::isinstance<py::array>(value)) {
    return pixels_from(py::reinterpret_borrow<py::array>(value), owner);
  } else {
    throw InvalidInput(
        owner +
        ": the source must be a path, an encoded file's bytes, an array of pixels, or a dictionary of these by tile");
  }
  return source;
}

}  // namespace

void expect_keywords(const py::dict& arguments, std::initializer_list<const char*> known, const std::string& function) {
  for (const auto& [key, value] : arguments) {
    const std::string name = py::str(key).cast<std::string>();
    if (std::none_of(known.begin(), known.end(), [&](const char* k) { return name == k; }))
      throw InvalidInput(function + " has no argument '" + name + "'");
  }
}

void read_image(Image& image, const py::handle& source, const py::dict& arguments) {
  expect_keywords(arguments, {"name", "colorspace", "alpha"}, "an image");
  set(image.name, arguments, "name", "an image");
  const std::string owner = "image '" + image.name + "'";
  set(image.colorspace, arguments, "colorspace", owner);
  set(image.alpha, arguments, "alpha", owner);
  choose<4>({"straight", "premultiplied", "channel_packed", "none"}, image.alpha, owner + ": alpha");
  image.tiles.clear();
  if (!py::isinstance<py::dict>(source)) {
    image.tiles[1001] = source_from(source, owner);
    return;
  }
  for (const auto& [tile, value] : py::reinterpret_borrow<py::dict>(source)) {
    if (!py::isinstance<py::int_>(tile)) throw InvalidInput(owner + ": tiles must be numbers as 1001");
    image.tiles[tile.cast<int>()] = source_from(value, owner);
  }
}

void read_material(Material& material, const py::handle& graph, const py::dict& arguments) {
  expect_keywords(arguments, {"name", "pass_index", "emission_sampling", "backface_culling"}, "a material");
  set(material.name, arguments, "name", "a material");
  const std::string owner = "material '" + material.name + "'";
  set(material.pass_index, arguments, "pass_index", owner);
  set(material.emission_sampling, arguments, "emission_sampling", owner);
  set(material.backface_culling, arguments, "backface_culling", owner);
  material.graph = graph_from_python(graph, owner);
}

void read_light(Light& light, const py::dict& arguments) {
  expect_keywords(
      arguments,
      {"kind", "transform", "name", "color", "power", "radius", "angle", "spot_size", "spot_blend", "shape", "size",
       "spread", "graph", "visibility", "cast_shadow", "multiple_importance", "soft_falloff", "version"},
      "a light");
  set(light.name, arguments, "name", "a light");
  const std::string owner = "light '" + light.name + "'";
  given<std::string>(arguments, "kind", owner, [&](const std::string& kind) {
    light.kind = LightKind(choose<4>({"point", "spot", "sun", "area"}, kind, owner + ": kind"));
  });
  given<std::string>(arguments, "shape", owner, [&](const std::string& shape) {
    light.shape = AreaShape(choose<4>({"square", "rectangle", "disk", "ellipse"}, shape, owner + ": shape"));
  });
  set_transform(light.transform, arguments, owner);
  set_vector<3>(light.color, arguments, "color", owner);
  set_vector<2>(light.size, arguments, "size", owner);
  set_number(light.power, arguments, "power", owner);
  set_number(light.radius, arguments, "radius", owner, 0.0f);
  set_number(light.angle, arguments, "angle", owner, 0.0f);
  set_number(light.spot_size, arguments, "spot_size", owner, 0.0f);
  set_number(light.spot_blend, arguments, "spot_blend", owner, 0.0f);
  set_number(light.spread, arguments, "spread", owner, 0.0f);
  set(light.visibility, arguments, "visibility", owner);
  set(light.cast_shadow, arguments, "cast_shadow", owner);
  set(light.multiple_importance, arguments, "multiple_importance", owner);
  set(light.soft_falloff, arguments, "soft_falloff", owner);
  set(light.version, arguments, "version", owner);
  if (!arguments.contains("graph")) return;
  light.graph.reset();
  if (!arguments["graph"].is_none()) light.graph = graph_from_python(arguments["graph"], owner);
}

void read_world(World& world, const py::handle& graph, const py::dict& arguments) {
  expect_keywords(arguments, {"visibility", "importance_resolution"}, "set_world");
  set(world.visibility, arguments, "visibility", "the world");
  set(world.importance_resolution, arguments, "importance_resolution", "the world");
  world.graph.reset();
  if (!graph.is_none()) world.graph = graph_from_python(graph, "the world");
}

void read_camera(Camera& camera, const py::dict& arguments) {
  const std::string owner = "the camera";
  expect_keywords(arguments,
                  {"kind", "transform", "window", "clip", "aperture_radius", "focus_distance", "aperture_blades",
                   "aperture_rotation", "aperture_ratio", "panorama"},
                  "set_camera");
  given<std::string>(arguments, "kind", owner, [&](const std::string& kind) {
    camera.kind = CameraKind(choose<3>({"perspective", "orthographic", "panorama"}, kind, owner + ": kind"));
  });
  set_transform(camera.transform, arguments, owner);
  set_vector<4>(camera.window, arguments, "window", owner);
  set_vector<4>(camera.panorama, arguments, "panorama", owner);
  set_vector<2>(camera.clip, arguments, "clip", owner, false);
  set_number(camera.aperture_radius, arguments, "aperture_radius", owner, 0.0f);
  set_number(camera.focus_distance, arguments, "focus_distance", owner, 0.0f);
  set_number(camera.aperture_rotation, arguments, "aperture_rotation", owner);
  set_number(camera.aperture_ratio, arguments, "aperture_ratio", owner, 1e-6f);
  set(camera.aperture_blades, arguments, "aperture_blades", owner);
  const bool panorama = camera.kind == CameraKind::kPanorama;
  if (!panorama && (camera.window.x == camera.window.y || camera.window.z == camera.window.w))
    throw InvalidInput(owner + ": window has no area");
  if (!(camera.clip.x >= 0.0f && camera.clip.x < camera.clip.y))
    throw InvalidInput(owner + ": clip must be two distances, 0 <= near < far");
}

void read_instance(Instance& instance, const py::dict& arguments) {
  set(instance.name, arguments, "name", "an instance");
  const std::string owner = "object '" + instance.name + "'";
  given<py::object>(arguments, "materials", owner, [&](const py::object& value) {
    instance.materials.clear();
    for (const py::handle handle : value) instance.materials.push_back(handle.is_none() ? 0 : handle.cast<Handle>());
  });
  set(instance.mesh, arguments, "mesh", owner);
  set(instance.visibility, arguments, "visibility", owner);
  set(instance.object_index, arguments, "object_index", owner);
  set(instance.holdout, arguments, "holdout", owner);
  set(instance.shadow_catcher, arguments, "shadow_catcher", owner);
  set_vector<4>(instance.color, arguments, "color", owner);
}

}  // namespace afterglow
