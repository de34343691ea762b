// SPDX-License-Identifier: GPL-3.0-or-later
// Geometry at a hit: see surface_point.h.
#include "rays/surface_point.h"

#include <algorithm>

namespace afterglow {

namespace {

constexpr float kEpsilon = 0x1p-24f;   // half a unit in the last place of 1
constexpr float kRoundings = 16.0f;    // that may meet in a position, counted generously
constexpr float kLeastCosine = 1e-3f;  // between shading normal and outgoing direction

/// Squares of very small and very large vectors leave the range: the slow way.
[[gnu::cold, gnu::noinline]] Vec3 extreme_unit_or_zero(const Vec3& v) {
  const float largest = std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
  if (!(largest > 0.0f) || !std::isfinite(largest)) return Vec3(0.0f);
  const Vec3 scaled = v / largest;
  return scaled / glm::length(scaled);
}

/// Normalised, or zero where there is no direction to speak of.
inline Vec3 unit_or_zero(const Vec3& v) {
  const float length2 = glm::dot(v, v);
  if (length2 > 1e-30f && length2 < 1e30f) return v * (1.0f / std::sqrt(length2));
  return extreme_unit_or_zero(v);
}

Vec3 face_normal(const Vec3& a, const Vec3& b) {
  const Vec3 n = glm::cross(a, b);
  if (glm::dot(n, n) > 1e-24f) return n;
  return glm::cross(glm::dvec3(a), glm::dvec3(b)) * 1e12;
}

/// The interpolated normal in world space, or zero where the mesh has none there.
Vec3 smooth_normal(const InstanceRecord& record, const Mesh& mesh, const SurfacePoint& at, const uint32_t* vertex) {
  if (!mesh.smooth.empty() && !mesh.smooth[at.triangle]) return Vec3(0.0f);
  const float w = 1.0f - at.u - at.v;
  Vec3 n(0.0f);
  if (!mesh.corner_normals.empty()) {
    const size_t first = 3 * size_t(at.triangle);
    const auto corner = [&](size_t k) -> const Vec3& {
      return mesh.corner_normals[mesh.corners.empty() ? first + k : mesh.corners[first + k]];
    };
    n = w * corner(0) + at.u * corner(1) + at.v * corner(2);
  } else if (!mesh.vertex_normals.empty()) {
    n = w * mesh.vertex_normals[vertex[0]] + at.u * mesh.vertex_normals[vertex[1]] +
        at.v * mesh.vertex_normals[vertex[2]];
  } else {
    return n;
  }
  return unit_or_zero(record.to_object.transposed(n));
}

/// Bends n towards `outgoing` until it is seen from there.
Vec3 keep_visible(const Vec3& n, const Vec3& outgoing) {
  const float cosine = glm::dot(n, outgoing);
  if (cosine >= kLeastCosine) return n;
  return glm::normalize(n + (kLeastCosine - cosine) * 1.01f * outgoing);
}

uint32_t material_of(const Scene& scene, const InstanceRecord& record, uint32_t triangle) {
  const uint32_t slot = record.mesh->slots.empty() ? 0 : record.mesh->slots[triangle];
  return scene.material_slots()[record.first_material + std::min(slot, record.slot_count - 1)];
}

Vec2 active_uv(const Mesh& mesh, const SurfacePoint& at) {
  if (mesh.active_uv >= mesh.uvs.size()) return Vec2(0.0f);
  const std::vector<Vec2>& values = mesh.uvs[mesh.active_uv].values;
  if (values.empty()) return Vec2(0.0f);
  const size_t first = 3 * size_t(at.triangle);
  const auto corner = [&](size_t k) { return values[mesh.corners.empty() ? first + k : mesh.corners[first + k]]; };
  return (1.0f - at.u - at.v) * corner(0) + at.u * corner(1) + at.v * corner(2);
}

}  // namespace

float rounding_error(const Vec3& face_normal, const Vec3& bound, const Vec3& e1, const Vec3& e2) {
  // The next ray's own test rounds relative to its triangle's size, even where the plane is exact (z = 0).
  const Vec3 edges = glm::max(glm::abs(e1), glm::abs(e2));
  const float size = std::max(edges.x, std::max(edges.y, edges.z));
  return kRoundings * kEpsilon * (glm::dot(glm::abs(face_normal), bound) + 0.25f * size);
}

SurfacePoint surface_point(const Scene& scene, const Ray& ray, const Hit& hit, bool with_uv) {
  const InstanceRecord& record = scene.instances()[hit.instance];
  const Mesh& mesh = *record.mesh;
  // All that will be missed in the caches is asked for at once.
  const uint32_t* vertex = &mesh.triangles[3 * size_t(hit.triangle)];
  __builtin_prefetch(vertex);
  if (!mesh.corners.empty()) __builtin_prefetch(&mesh.corners[3 * size_t(hit.triangle)]);
  if (!mesh.smooth.empty()) __builtin_prefetch(&mesh.smooth[hit.triangle]);
  if (!mesh.slots.empty()) __builtin_prefetch(&mesh.slots[hit.triangle]);
  const Vec3 &p0 = mesh.positions[vertex[0]], &p1 = mesh.positions[vertex[1]], &p2 = mesh.positions[vertex[2]];
  SurfacePoint point;
  point.u = hit.u;
  point.v = hit.v;
  point.t = hit.t;
  point.instance = hit.instance;
  point.triangle = hit.triangle;
  point.outgoing = -ray.direction;
  const Vec3 e1 = p1 - p0, e2 = p2 - p0;
  point.position = record.to_world.point(p0 + hit.u * e1 + hit.v * e2);
  point.face_normal = unit_or_zero(record.to_object.transposed(face_normal(e1, e2)));
  if (point.face_normal == Vec3(0.0f)) point.face_normal = point.outgoing;

  // Every term that was added on the way to the position may have been rounded: of the corners, through the transform.
  const float w = 1.0f - hit.u - hit.v;
  const Vec3 terms = w * glm::abs(p0) + hit.u * glm::abs(p1) + hit.v * glm::abs(p2);
  const Affine& m = record.to_world;
  const Vec3 bound = glm::abs(m.x) * terms.x + glm::abs(m.y) * terms.y + glm::abs(m.z) * terms.z + glm::abs(m.p) +
                     glm::abs(point.position);
  point.error = rounding_error(point.face_normal, bound, m.vector(e1), m.vector(e2));

  point.backfacing = glm::dot(point.face_normal, ray.direction) > 0.0f;
  point.normal = smooth_normal(record, mesh, point, vertex);
  if (point.normal == Vec3(0.0f)) point.normal = point.face_normal;
  if (point.backfacing) {
    point.face_normal = -point.face_normal;
    point.normal = -point.normal;
  }
  point.normal = keep_visible(point.normal, point.outgoing);

  point.material = material_of(scene, record, hit.triangle);
  if (with_uv) point.uv = active_uv(mesh, point);
  return point;
}

Vec2 surface_uv(const Scene& scene, const SurfacePoint& point) {
  return active_uv(*scene.instances()[point.instance].mesh, point);
}

uint32_t material_at(const Scene& scene, const Hit& hit) {
  return material_of(scene, scene.instances()[hit.instance], hit.triangle);
}

Vec3 offset_origin(const SurfacePoint& point, const Vec3& direction) {
  const float side = glm::dot(direction, point.face_normal) < 0.0f ? -point.error : point.error;
  return point.position + side * point.face_normal;
}

}  // namespace afterglow
