// SPDX-License-Identifier: GPL-3.0-or-later
// Collects emissive triangles and samples them (see emissive_mesh.h).
#include "lights/emissive_mesh.h"

#include <algorithm>

#include "lights/shapes.h"

namespace afterglow {

namespace {

/// Far triangles are sampled by area: nearly as even there, and without a dozen arc functions a sample.
bool by_solid_angle(const Vec3& a, const Vec3& b, const Vec3& c, float& angle) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b, nine_centers = 3.0f * (a + b + c);
  const float longest2 = std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)});
  if (81.0f * longest2 < glm::dot(nine_centers, nine_centers)) return false;
  angle = triangle_solid_angle(a, b, c);
  return angle > kMinTriangleAngle && angle < kMaxTriangleAngle;
}

uint32_t material_of(const Scene& scene, const InstanceRecord& instance, uint32_t triangle) {
  const Mesh& mesh = *instance.mesh;
  const uint32_t slot = mesh.slots.empty() ? 0 : mesh.slots[triangle];
  return scene.material_slots()[instance.first_material + std::min(slot, instance.slot_count - 1)];
}

}  // namespace

bool sample_triangle(const EmissiveTriangle& t, const Vec3& position, const Vec2& u, TriangleSample& out) {
  const Vec3 a = t.a - position, b = a + t.edge_b, c = a + t.edge_c;
  float angle;
  const bool spherical = by_solid_angle(a, b, c, angle);
  if (spherical) {
    out.barycentric = sample_spherical_triangle(a, b, c, u);
  } else {
    const float root = std::sqrt(u.x);
    out.barycentric = {1.0f - root, u.y * root};
  }
  const Vec3 to_point = a + out.barycentric.x * t.edge_b + out.barycentric.y * t.edge_c;
  const float d2 = glm::dot(to_point, to_point);
  if (!(d2 > 0.0f)) return false;
  out.distance = std::sqrt(d2);
  out.direction = to_point / out.distance;
  if (spherical) {
    out.density = 1.0f / angle;
    return true;
  }
  const float projected = 0.5f * std::fabs(glm::dot(glm::cross(t.edge_b, t.edge_c), out.direction));  // area × cosine
  if (!(projected > 0.0f)) return false;
  out.density = d2 / projected;
  return std::isfinite(out.density);
}

float triangle_density(const EmissiveTriangle& t, const Vec3& position, const Vec3& direction, float distance) {
  const Vec3 a = t.a - position;
  float angle;
  if (by_solid_angle(a, a + t.edge_b, a + t.edge_c, angle)) return 1.0f / angle;
  const float projected = 0.5f * std::fabs(glm::dot(glm::cross(t.edge_b, t.edge_c), direction));
  return projected > 0.0f ? distance * distance / projected : 0.0f;
}

void EmissiveMeshes::collect(const Scene& scene, const Materials& materials) {
  triangles_.clear();
  ranges_.clear();
  const auto instances = scene.instances();
  const auto slots = scene.material_slots();
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const InstanceRecord& record = instances[i];
    if (!record.mesh || record.mesh->triangles.empty() || record.slot_count == 0) continue;
    bool any = false;
    for (uint32_t s = 0; s < record.slot_count; ++s) any |= materials.emits(slots[record.first_material + s]);
    if (!any) continue;
    const Mesh& mesh = *record.mesh;
    Range range{uint32_t(triangles_.size()), 0, false};
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      const uint32_t material = material_of(scene, record, t);
      if (!materials.emits(material)) continue;
      const uint32_t* v = &mesh.triangles[3 * size_t(t)];
      const Vec3 a = record.to_world.point(mesh.positions[v[0]]), b = record.to_world.point(mesh.positions[v[1]]),
                 c = record.to_world.point(mesh.positions[v[2]]);
      if (!is_finite(a) || !is_finite(b) || !is_finite(c)) continue;
      triangles_.push_back({a, b - a, c - a, i, t, material});
    }
    range.count = uint32_t(triangles_.size()) - range.first;
    range.whole = range.count == mesh.triangle_count();
    if (range.count) ranges_[i] = range;
  }
}

uint32_t EmissiveMeshes::find(uint32_t instance, uint32_t triangle) const {
  const auto it = ranges_.find(instance);
  if (it == ranges_.end()) return kNone;
  const Range& range = it->second;
  if (range.whole) return triangle < range.count ? range.first + triangle : kNone;
  const auto begin = triangles_.begin() + range.first, end = begin + range.count;
  const auto found =
      std::lower_bound(begin, end, triangle, [](const EmissiveTriangle& t, uint32_t x) { return t.triangle < x; });
  return found != end && found->triangle == triangle ? uint32_t(found - triangles_.begin()) : kNone;
}

LightBounds EmissiveMeshes::bounds(uint32_t index, const Rgb& mean_radiance) const {
  const EmissiveTriangle& t = triangles_[index];
  const Vec3 n = glm::cross(t.edge_b, t.edge_c);
  const float length = glm::length(n);
  LightBounds bounds;
  bounds.box.extend(t.a);
  bounds.box.extend(t.a + t.edge_b);
  bounds.box.extend(t.a + t.edge_c);
  bounds.axis = length > 0.0f ? n / length : Vec3(0, 0, 1);
  bounds.cos_normals = 1.0f, bounds.cos_emission = 0.0f;
  bounds.two_sided = true;
  bounds.intensity = 0.5f * length * std::max(luminance(mean_radiance), 0.0f);
  if (!std::isfinite(bounds.intensity)) bounds.intensity = 0.0f;
  return bounds;
}

}  // namespace afterglow
