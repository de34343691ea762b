// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes from numpy arrays: see mesh_from_python.h. What would only repeat a default is not stored.
#include "module/mesh_from_python.h"

#include <algorithm>
#include <array>
#include <functional>

#include "base/parallel.h"
#include "module/arrays.h"

namespace afterglow {

namespace {

py::object argument(const py::dict& arguments, const char* name) {
  return arguments.contains(name) ? py::object(arguments[name]) : py::none();
}

struct AttributeColumn {
  std::string name;
  Domain domain;
  Column column;
  bool bytes = false;
};

AttributeColumn attribute_column(const py::handle& key, const py::handle& value, const std::string& owner) {
  if (!py::isinstance<py::str>(key)) throw InvalidInput(owner + ": an attribute's name must be a string");
  AttributeColumn out;
  out.name = key.cast<std::string>();
  const std::string what = owner + ": attribute '" + out.name + "'";
  if (!py::isinstance<py::tuple>(value) || py::len(value) != 2 || !py::isinstance<py::str>(value[py::int_(0)]))
    throw InvalidInput(what + " must be (domain, array)");
  const std::string domain = value[py::int_(0)].cast<std::string>();
  constexpr std::array<const char*, 4> names = {"vertex", "corner", "face", "mesh"};
  const auto found = std::find(names.begin(), names.end(), domain);
  if (found == names.end())
    throw InvalidInput(what + ": unknown domain '" + domain + "'; there are vertex, corner, face and mesh");
  out.domain = Domain(found - names.begin());
  const py::object array = value[py::int_(1)];
  out.bytes = py::isinstance<py::array_t<uint8_t>>(array);
  out.column = float_column(array, what, 0);
  return out;
}

/// Values of each face, spread to its triangles.
template <class Out, class In>
std::vector<Out> per_triangle(const std::vector<In>& values, const std::vector<uint32_t>& faces, size_t triangles,
                              const std::string& what) {
  const size_t wanted = faces.empty() ? triangles : size_t(*std::max_element(faces.begin(), faces.end())) + 1;
  if (values.size() < wanted || (faces.empty() && values.size() != wanted))
    throw InvalidInput(what + " has " + std::to_string(values.size()) + " entries where " + std::to_string(wanted) +
                       " are needed");
  std::vector<Out> out(triangles);
  for (size_t t = 0; t < triangles; ++t) out[t] = Out(values[faces.empty() ? t : faces[t]]);
  return out;
}

bool counts_up(const std::vector<uint32_t>& values) {
  for (size_t i = 0; i < values.size(); ++i)
    if (values[i] != i) return false;
  return true;
}

template <class T>
bool all_equal_to(const std::vector<T>& values, T wanted) {
  return std::all_of(values.begin(), values.end(), [=](T v) { return v == wanted; });
}

struct Columns {
  Column positions, previous, triangles, corners, corner_vertices, corner_normals, vertex_normals, smooth, faces,
      materials;
  std::vector<std::pair<std::string, Column>> uvs;
  std::vector<AttributeColumn> attributes;
  std::string active_uv, active_color;
};

std::string text(const py::dict& arguments, const char* name) {
  const py::object value = argument(arguments, name);
  return value.is_none() ? std::string() : py::str(value).cast<std::string>();
}

Columns columns_from(const py::dict& arguments, const std::string& owner) {
  const auto array = [&](const char* name) { return argument(arguments, name); };
  const auto what = [&](const char* name) { return owner + ": " + name; };
  if (array("positions").is_none()) throw InvalidInput(what("positions") + " are missing");
  const bool by_corners = !array("corner_vertices").is_none() && !array("corners").is_none();
  if (array("triangles").is_none() && !by_corners)
    throw InvalidInput(what("triangles") + " are missing, and so are corners with corner_vertices");
  Columns c;
  c.positions = float_column(array("positions"), what("positions"), 3);
  c.previous = float_column(array("previous_positions"), what("previous_positions"), 3);
  c.triangles = index_column(array("triangles"), what("triangles"), 3);
  c.corners = index_column(array("corners"), what("corners"), 3);
  c.corner_vertices = index_column(array("corner_vertices"), what("corner_vertices"), 1);
  c.corner_normals = float_column(array("corner_normals"), what("corner_normals"), 3);
  c.vertex_normals = float_column(array("vertex_normals"), what("vertex_normals"), 3);
  c.smooth = flag_column(array("smooth"), what("smooth"));
  c.faces = index_column(array("faces"), what("faces"), 1);
  c.materials = index_column(array("materials"), what("materials"), 1);
  const auto dict = [&](const char* name) {
    const py::object value = array(name);
    if (value.is_none()) return py::dict();
    if (!py::isinstance<py::dict>(value)) throw InvalidInput(what(name) + " must be a dictionary");
    return py::dict(value);
  };
  for (const auto& [key, value] : dict("uvs")) {
    const std::string uv = py::str(key).cast<std::string>();
    c.uvs.emplace_back(uv, float_column(value, owner + ": UV map '" + uv + "'", 2));
  }
  for (const auto& [key, value] : dict("attributes")) c.attributes.push_back(attribute_column(key, value, owner));
  c.active_uv = text(arguments, "active_uv");
  c.active_color = text(arguments, "active_color");
  return c;
}

/// Triangles as they are given, or the vertices of their corners: beyond all vertices where there is no such corner.
std::vector<uint32_t> take_triangles(const Columns& c) {
  if (c.triangles.data || !c.corner_vertices.data) return take<uint32_t>(c.triangles);
  std::vector<uint32_t> out = take<uint32_t>(c.corners);
  const char* vertices = c.corner_vertices.data;
  const size_t count = c.corner_vertices.rows;
  const py::ssize_t stride = c.corner_vertices.row_stride;
  parallel_blocks(out.size(), size_t(1) << 18, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      uint32_t vertex = kNone;
      if (out[i] < count) std::memcpy(&vertex, vertices + py::ssize_t(out[i]) * stride, 4);
      out[i] = vertex;
    }
  });
  return out;
}

/// Whether anything is given by corner, so that it matters which ones a triangle has.
bool reads_corners(const Columns& c) {
  return c.corner_normals.rows || !c.uvs.empty() ||
         std::any_of(c.attributes.begin(), c.attributes.end(),
                     [](const AttributeColumn& a) { return a.domain == Domain::kCorner; });
}

void take_faces(Mesh& mesh, const Columns& c, const std::string& owner) {
  std::vector<uint32_t> faces = take<uint32_t>(c.faces);
  const size_t triangles = mesh.triangles.size() / 3;
  if (!faces.empty() && faces.size() != triangles)
    throw InvalidInput(owner + ": faces has " + std::to_string(faces.size()) + " entries where " +
                       std::to_string(triangles) + " are needed");
  if (c.smooth.rows && triangles) {
    mesh.smooth = per_triangle<uint8_t>(take<uint8_t>(c.smooth), faces, triangles, owner + ": smooth");
    if (all_equal_to<uint8_t>(mesh.smooth, 1)) mesh.smooth = {};
  }
  if (c.materials.rows && triangles) {
    std::vector<uint32_t> slots = take<uint32_t>(c.materials);
    for (uint32_t& slot : slots) slot = std::min(slot, 0xffffu);
    mesh.slots = per_triangle<uint16_t>(slots, faces, triangles, owner + ": materials");
    if (all_equal_to<uint16_t>(mesh.slots, 0)) mesh.slots = {};
  }
  const bool asked = std::any_of(c.attributes.begin(), c.attributes.end(),
                                 [](const AttributeColumn& a) { return a.domain == Domain::kFace; });
  if (asked && !counts_up(faces)) mesh.faces = std::move(faces);
}

Mesh mesh_of(const Columns& c, const std::string& name, const std::string& owner) {
  Mesh mesh;
  mesh.name = name;
  mesh.uvs.resize(c.uvs.size());
  // Each is a copy of its own: side by side where they are long.
  std::vector<std::function<void()>> copies = {[&] { mesh.positions = take<Vec3>(c.positions); },
                                               [&] { mesh.previous_positions = take<Vec3>(c.previous); },
                                               [&] { mesh.triangles = take_triangles(c); },
                                               [&] {
                                                 if (reads_corners(c)) mesh.corners = take<uint32_t>(c.corners);
                                               },
                                               [&] { mesh.corner_normals = take<Vec3>(c.corner_normals); },
                                               [&] { mesh.vertex_normals = take<Vec3>(c.vertex_normals); }};
  for (size_t i = 0; i < c.uvs.size(); ++i) {
    if (c.uvs[i].first == c.active_uv) mesh.active_uv = uint32_t(i);
    copies.push_back([&, i] { mesh.uvs[i] = {c.uvs[i].first, take<Vec2>(c.uvs[i].second)}; });
  }
  parallel_blocks(copies.size(), 1, std::max(c.triangles.rows, c.corners.rows) < 20'000 ? 1 : 0,
                  [&](size_t begin, size_t end) {
                    for (size_t i = begin; i < end; ++i) copies[i]();
                  });
  take_faces(mesh, c, owner);
  for (const AttributeColumn& a : c.attributes) {
    if (a.name == c.active_color) mesh.active_color = uint32_t(mesh.attributes.size());
    mesh.attributes.push_back({a.name, a.domain, uint8_t(a.column.width), take<float>(a.column)});
    if (a.bytes)
      for (float& value : mesh.attributes.back().values) value *= 1.0f / 255.0f;
  }
  if (mesh.corners.size() == mesh.triangles.size() && counts_up(mesh.corners)) {
    const size_t corners = mesh.corners.size();
    bool fits = mesh.corner_normals.empty() || mesh.corner_normals.size() == corners;
    for (const UvMap& uv : mesh.uvs) fits &= uv.values.size() == corners;
    for (const Attribute& a : mesh.attributes)
      fits &= a.domain != Domain::kCorner || a.values.size() == corners * a.width;
    if (fits) mesh.corners = {};
  }
  return mesh;
}

}  // namespace

Mesh mesh_from_python(const py::dict& arguments, const std::string& name) {
  const std::string owner = "mesh '" + name + "'";
  const Columns columns = columns_from(arguments, owner);
  const py::gil_scoped_release free;
  return mesh_of(columns, name, owner);
}

bool only_deforms(const py::dict& arguments) {
  if (argument(arguments, "positions").is_none()) return false;
  for (const auto& [key, value] : arguments) {
    const std::string name = py::str(key).cast<std::string>();
    const bool moves = name == "positions" || name == "corner_normals" || name == "vertex_normals" ||
                       name == "previous_positions" || name == "name";
    if (!moves && !value.is_none()) return false;
  }
  return true;
}

Deformation deformation_from_python(const py::dict& arguments, const std::string& name) {
  const std::string owner = "mesh '" + name + "'";
  const Column positions = float_column(argument(arguments, "positions"), owner + ": positions", 3);
  const Column corner = float_column(argument(arguments, "corner_normals"), owner + ": corner_normals", 3);
  const Column vertex = float_column(argument(arguments, "vertex_normals"), owner + ": vertex_normals", 3);
  const py::gil_scoped_release free;
  return {take<Vec3>(positions), take<Vec3>(corner), take<Vec3>(vertex)};
}

}  // namespace afterglow
