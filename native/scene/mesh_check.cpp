// SPDX-License-Identifier: GPL-3.0-or-later
// Checks and repairs of meshes: see mesh_check.h.
#include "scene/mesh_check.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <span>

#include "base/errors.h"
#include "base/parallel.h"

namespace afterglow {

namespace {

// Four lanes: a minimum over floats is not reordered by the compiler, so it is written in order of lanes.
using Lanes = float __attribute__((vector_size(16)));

Lanes load(const float* p) {
  Lanes v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

/// Items of long arrays that a thread looks at in one go; shorter ones are not worth waking another for.
constexpr size_t kLong = size_t(1) << 18;

/// True when all of n floats are finite: 0 × x is 0 for those alone.
bool block_is_finite(const float* p, size_t n) {
  Lanes sum[4] = {};
  size_t i = 0;
  for (; i + 16 <= n; i += 16)
    for (size_t k = 0; k < 4; ++k) sum[k] += load(p + i + 4 * k) * 0.0f;
  float rest = 0.0f;
  for (; i < n; ++i) rest += p[i] * 0.0f;
  for (const Lanes& s : sum) rest += s[0] + s[1] + s[2] + s[3];
  return rest == 0.0f;
}

bool all_finite(const float* p, size_t n) {
  std::atomic<bool> finite{true};
  parallel_blocks(n, kLong, [&](size_t begin, size_t end) {
    if (!block_is_finite(p + begin, end - begin)) finite = false;
  });
  return finite;
}

bool all_finite(const std::vector<Vec3>& v) { return v.empty() || all_finite(&v[0].x, 3 * v.size()); }

/// Bounds of finite vertices.
Box bounds_of(std::span<const Vec3> positions) {
  Box box;
  size_t i = 0;
  if (positions.size() >= 4) {
    const float* p = &positions[0].x;
    Lanes lower[3], upper[3];  // three registers hold four vertices: lane l of register k is coordinate (4k + l) mod 3
    for (size_t k = 0; k < 3; ++k) lower[k] = upper[k] = load(p + 4 * k);
    for (; i + 4 <= positions.size(); i += 4)
      for (size_t k = 0; k < 3; ++k) {
        const Lanes v = load(p + 3 * i + 4 * k);
        lower[k] = v < lower[k] ? v : lower[k];
        upper[k] = v > upper[k] ? v : upper[k];
      }
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 4; ++l) {
        const int axis = (4 * k + l) % 3;
        box.lower[axis] = std::min(box.lower[axis], lower[k][l]);
        box.upper[axis] = std::max(box.upper[axis], upper[k][l]);
      }
  }
  for (; i < positions.size(); ++i) box.extend(positions[i]);
  return box;
}

Box bounds_of_all(std::span<const Vec3> positions) {
  std::vector<Box> parts((positions.size() + kLong - 1) / kLong);
  parallel_blocks(positions.size(), kLong, [&](size_t begin, size_t end) {
    parts[begin / kLong] = bounds_of(positions.subspan(begin, end - begin));
  });
  Box box;
  for (const Box& part : parts) box.extend(part);
  return box;
}

std::string quoted(const Mesh& mesh) { return "mesh '" + mesh.name + "'"; }

void expect_size(const Mesh& mesh, const std::string& array, size_t size, size_t wanted, bool optional = true) {
  if (size == wanted || (optional && size == 0)) return;
  throw InvalidInput(quoted(mesh) + ": " + array + " has " + std::to_string(size) + " entries where " +
                     std::to_string(wanted) + " are needed");
}

/// How many per-corner values there are, or kNone when no array tells.
size_t corner_count(const Mesh& mesh) {
  if (!mesh.corner_normals.empty()) return mesh.corner_normals.size();
  for (const UvMap& uv : mesh.uvs)
    if (!uv.values.empty()) return uv.values.size();
  for (const Attribute& a : mesh.attributes)
    if (a.domain == Domain::kCorner && a.width) return a.values.size() / a.width;
  return kNone;
}

uint32_t largest(const std::vector<uint32_t>& v) {
  std::vector<uint32_t> parts((v.size() + kLong - 1) / kLong, 0);
  parallel_blocks(v.size(), kLong, [&](size_t begin, size_t end) {
    uint32_t m = 0;
    for (size_t i = begin; i < end; ++i) m = std::max(m, v[i]);
    parts[begin / kLong] = m;
  });
  uint32_t m = 0;
  for (const uint32_t part : parts) m = std::max(m, part);
  return m;
}

void check_sizes(const Mesh& mesh) {
  const size_t v = mesh.positions.size(), t = mesh.triangles.size() / 3;
  if (mesh.triangles.size() % 3) throw InvalidInput(quoted(mesh) + ": triangles must come in threes of vertex indices");
  if (v > 0x7fffffffu || t > 0x7fffffffu) throw InvalidInput(quoted(mesh) + ": more than 2^31 vertices or triangles");
  expect_size(mesh, "previous_positions", mesh.previous_positions.size(), v);
  expect_size(mesh, "corners", mesh.corners.size(), 3 * t);
  expect_size(mesh, "vertex_normals", mesh.vertex_normals.size(), v);
  expect_size(mesh, "smooth", mesh.smooth.size(), t);
  expect_size(mesh, "materials", mesh.slots.size(), t);
  expect_size(mesh, "faces", mesh.faces.size(), t);
  const size_t corners = mesh.corners.empty() ? 3 * t : corner_count(mesh);
  if (corners == kNone) return;
  expect_size(mesh, "corner_normals", mesh.corner_normals.size(), corners);
  for (const UvMap& uv : mesh.uvs) expect_size(mesh, "UV map '" + uv.name + "'", uv.values.size(), corners);
  size_t faces = t;
  if (!mesh.faces.empty()) faces = size_t(largest(mesh.faces)) + 1;
  for (const Attribute& a : mesh.attributes) {
    const std::string name = "attribute '" + a.name + "'";
    if (a.width < 1 || a.width > 4) throw InvalidInput(quoted(mesh) + ": " + name + " must have 1 to 4 components");
    const size_t n = a.values.size() / a.width;
    if (a.domain == Domain::kVertex) expect_size(mesh, name, n, v, false);
    if (a.domain == Domain::kCorner) expect_size(mesh, name, n, corners, false);
    if (a.domain == Domain::kMesh) expect_size(mesh, name, n, 1, false);
    if (a.domain == Domain::kFace && n < faces) expect_size(mesh, name, n, faces, false);
  }
}

void drop(Mesh& mesh, uint32_t triangle, MeshRepairs& repairs) {
  uint32_t* index = &mesh.triangles[3 * size_t(triangle)];
  repairs.dropped.push_back({triangle, {index[0], index[1], index[2]}});
  index[0] = index[1] = index[2] = 0;
}

std::string counted(size_t n, const char* what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

void check_triangles(Mesh& mesh, MeshRepairs& repairs) {
  const size_t vertices = mesh.positions.size();
  if (mesh.triangles.empty() || (vertices && largest(mesh.triangles) < vertices)) return;
  size_t bad = 0;
  if (vertices == 0) {
    bad = mesh.triangle_count();
    mesh.positions.assign(1, Vec3(0.0f));  // what harmless triangles point at
    if (!mesh.vertex_normals.empty()) mesh.vertex_normals.assign(1, Vec3(0, 0, 1));
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) drop(mesh, t, repairs);
  } else {
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      const uint32_t* index = &mesh.triangles[3 * size_t(t)];
      if (std::max({index[0], index[1], index[2]}) < vertices) continue;
      drop(mesh, t, repairs);
      ++bad;
    }
  }
  repairs.warnings.push_back(quoted(mesh) + ": " + counted(bad, "triangle") +
                             " left out: array 'triangles' names vertices beyond the " + std::to_string(vertices) +
                             " of 'positions'");
}

void check_positions(Mesh& mesh, MeshRepairs& repairs) {
  if (!all_finite(mesh.positions)) {
    const size_t before = repairs.dropped.size();
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      const uint32_t* index = &mesh.triangles[3 * size_t(t)];
      if (is_finite(mesh.positions[index[0]]) && is_finite(mesh.positions[index[1]]) &&
          is_finite(mesh.positions[index[2]]))
        continue;
      drop(mesh, t, repairs);
    }
    size_t bad = 0, first = mesh.positions.size();
    Vec3 stand_in(0.0f);  // a finite vertex, so that bounds do not grow
    for (const Vec3& p : mesh.positions)
      if (is_finite(p)) {
        stand_in = p;
        break;
      }
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
      if (is_finite(mesh.positions[v])) continue;
      mesh.positions[v] = stand_in;
      first = std::min(first, v);
      ++bad;
    }
    repairs.warnings.push_back(quoted(mesh) + ": array 'positions' holds " +
                               (bad == 1 ? "a non-finite vertex" : std::to_string(bad) + " non-finite vertices") +
                               " (first: index " + std::to_string(first) + "); " +
                               counted(repairs.dropped.size() - before, "triangle") + " left out");
  }
  mesh.bounds = bounds_of_all(mesh.positions);
}

/// A non-finite normal becomes 0, which surface_point takes as "use the face's".
void check_normals(Mesh& mesh, std::vector<Vec3>& normals, const char* array, MeshRepairs& repairs) {
  if (all_finite(normals)) return;
  size_t bad = 0;
  for (Vec3& n : normals) {
    if (is_finite(n)) continue;
    n = Vec3(0.0f);
    ++bad;
  }
  repairs.warnings.push_back(quoted(mesh) + ": array '" + array + "' holds " + counted(bad, "non-finite normal") +
                             "; the face's normal is used there");
}

void check_floats(Mesh& mesh, float* values, size_t n, const std::string& array, MeshRepairs& repairs) {
  if (n == 0 || all_finite(values, n)) return;
  for (size_t i = 0; i < n; ++i)
    if (!std::isfinite(values[i])) values[i] = 0.0f;
  repairs.warnings.push_back(quoted(mesh) + ": " + array + " holds non-finite values, taken as 0");
}

void check_normals(Mesh& mesh, MeshRepairs& repairs) {
  check_normals(mesh, mesh.corner_normals, "corner_normals", repairs);
  check_normals(mesh, mesh.vertex_normals, "vertex_normals", repairs);
}

}  // namespace

MeshRepairs check_mesh(Mesh& mesh) {
  check_sizes(mesh);
  MeshRepairs repairs;
  check_triangles(mesh, repairs);
  check_positions(mesh, repairs);
  check_normals(mesh, repairs);
  const size_t corners = corner_count(mesh);
  if (!mesh.corners.empty() && corners != kNone && largest(mesh.corners) >= corners) {
    for (uint32_t& c : mesh.corners) c = c < corners ? c : 0;
    repairs.warnings.push_back(quoted(mesh) + ": array 'corners' names corners beyond the " + std::to_string(corners) +
                               " of the per-corner arrays; the first is used there");
  }
  for (UvMap& uv : mesh.uvs)
    if (!uv.values.empty())
      check_floats(mesh, &uv.values[0].x, 2 * uv.values.size(), "UV map '" + uv.name + "'", repairs);
  for (Attribute& a : mesh.attributes)
    check_floats(mesh, a.values.data(), a.values.size(), "attribute '" + a.name + "'", repairs);
  if (!all_finite(mesh.previous_positions)) {
    mesh.previous_positions.clear();
    repairs.warnings.push_back(quoted(mesh) + ": array 'previous_positions' holds non-finite values and is not used");
  }
  if (mesh.active_uv >= mesh.uvs.size()) mesh.active_uv = mesh.uvs.empty() ? kNone : 0;
  if (mesh.active_color >= mesh.attributes.size()) mesh.active_color = kNone;
  return repairs;
}

MeshRepairs check_deformed(Mesh& mesh, const std::vector<DroppedTriangle>& dropped_before) {
  for (auto d = dropped_before.rbegin(); d != dropped_before.rend(); ++d)  // one dropped twice: its first form last
    for (size_t k = 0; k < 3; ++k) mesh.triangles[3 * size_t(d->triangle) + k] = d->vertices[k];
  MeshRepairs repairs;
  check_triangles(mesh, repairs);
  check_positions(mesh, repairs);
  check_normals(mesh, repairs);
  return repairs;
}

MeshDifference mesh_difference(const Mesh& a, const Mesh& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() && (x.empty() || !std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])));
  };
  const auto same_uv = [&](const UvMap& x, const UvMap& y) { return x.name == y.name && same(x.values, y.values); };
  const auto same_attribute = [&](const Attribute& x, const Attribute& y) {
    return x.name == y.name && x.domain == y.domain && x.width == y.width && same(x.values, y.values);
  };
  const bool topology =
      a.name == b.name && a.positions.size() == b.positions.size() &&
      a.previous_positions.empty() == b.previous_positions.empty() &&
      a.corner_normals.size() == b.corner_normals.size() && a.vertex_normals.size() == b.vertex_normals.size() &&
      a.active_uv == b.active_uv && a.active_color == b.active_color && same(a.triangles, b.triangles) &&
      same(a.corners, b.corners) && same(a.smooth, b.smooth) && same(a.slots, b.slots) && same(a.faces, b.faces) &&
      std::equal(a.uvs.begin(), a.uvs.end(), b.uvs.begin(), b.uvs.end(), same_uv) &&
      std::equal(a.attributes.begin(), a.attributes.end(), b.attributes.begin(), b.attributes.end(), same_attribute);
  if (!topology) return MeshDifference::kOther;
  const bool shape = same(a.positions, b.positions) && same(a.previous_positions, b.previous_positions) &&
                     same(a.corner_normals, b.corner_normals) && same(a.vertex_normals, b.vertex_normals);
  return shape ? MeshDifference::kNone : MeshDifference::kShape;
}

}  // namespace afterglow
