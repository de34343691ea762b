// SPDX-License-Identifier: GPL-3.0-or-later
// Collects emissive triangles and samples them (see emissive_mesh.h). Rectangles near a surface are also warped by the
// receiver's cosine, bilinear over the corners (Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th
// ed., 6.5).
#include "lights/emissive_mesh.h"

#include <algorithm>

#include "lights/shapes.h"

namespace afterglow {

namespace {

/// Far patches are sampled by area: nearly as even there, and without a dozen arc functions a sample.
bool near_patch(const EmissivePatch& t, const Vec3& position) {
  const Vec3 to_middle = t.a + (t.rectangle() ? 0.5f : 1.0f / 3.0f) * (t.edge_b + t.edge_c) - position;
  const float longest2 = std::max(glm::dot(t.edge_b, t.edge_b), glm::dot(t.edge_c, t.edge_c));
  return glm::dot(to_middle, to_middle) < 2.0f * longest2;
}

bool triangle_by_angle(const Vec3& a, const Vec3& b, const Vec3& c, float& angle) {
  angle = triangle_solid_angle(a, b, c);
  return angle > kMinTriangleAngle && angle < kMaxTriangleAngle;
}

Vec3 normal_of(const Vec3& b, const Vec3& c) {
  const glm::dvec3 n = glm::cross(glm::dvec3(b), glm::dvec3(c));
  const double length = glm::length(n);
  return length > 0.0 ? Vec3(n / length) : Vec3(0.0f);
}

/// A shadow ray must end before the light's own face, however flat it comes in: by the face's rounding along its
/// normal, and by what the ray's direction is rounded.
Vec3 margin_of(const EmissivePatch& t, const Vec3& direction, float distance) {
  const float step = t.error + 1e-6f * distance;
  return glm::dot(t.normal, direction) > 0.0f ? -step * t.normal : step * t.normal;
}

/// Area times cosine.
float projected_area(const EmissivePatch& t, const Vec3& direction) {
  return (t.rectangle() ? 1.0f : 0.5f) * std::fabs(glm::dot(glm::cross(t.edge_b, t.edge_c), direction));
}

/// Weights of the corners by the cosine at the receiver; flat where the receiver has no side.
CosineWarp rectangle_warp(const EmissivePatch& t, const Vec3& position, const Vec3& normal) {
  if (glm::dot(normal, normal) == 0.0f) return {};
  const Vec3 a = t.a - position;
  auto cosine = [&](const Vec3& to) {
    const float length = glm::length(to);
    return length > 0.0f ? glm::dot(to, normal) / length : 0.0f;
  };
  return {cosine(a), cosine(a + t.edge_b), cosine(a + t.edge_c), cosine(a + t.edge_b + t.edge_c)};
}

uint32_t material_of(const Scene& scene, const InstanceRecord& instance, uint32_t triangle) {
  const Mesh& mesh = *instance.mesh;
  const uint32_t slot = mesh.slots.empty() ? 0 : mesh.slots[triangle];
  return scene.material_slots()[instance.first_material + std::min(slot, instance.slot_count - 1)];
}

bool make_patch(const Scene& scene, const Materials& materials, const InstanceRecord& record, uint32_t instance,
                uint32_t t, EmissivePatch& patch) {
  patch.material = material_of(scene, record, t);
  if (!materials.emits(patch.material)) return false;
  const Mesh& mesh = *record.mesh;
  const uint32_t* v = &mesh.triangles[3 * size_t(t)];
  const Vec3 a = record.to_world.point(mesh.positions[v[0]]), b = record.to_world.point(mesh.positions[v[1]]),
             c = record.to_world.point(mesh.positions[v[2]]);
  if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return false;
  patch.a = a, patch.edge_b = b - a, patch.edge_c = c - a;
  const Vec3 n = normal_of(patch.edge_b, patch.edge_c),
             bound = glm::max(glm::abs(a), glm::max(glm::abs(b), glm::abs(c)));
  patch.normal = n;
  patch.error = rounding_error(n, bound + glm::abs(record.to_world.p), patch.edge_b, patch.edge_c);
  patch.instance = instance, patch.triangle = t;
  return true;
}

/// Makes `first` a rectangle when the next triangle of its mesh is its other half.
bool unite(const Mesh& mesh, EmissivePatch& first, uint32_t next, const EmissivePatch& patch) {
  if (first.material != patch.material) return false;
  const uint32_t *v = &mesh.triangles[3 * size_t(first.triangle)], *w = &mesh.triangles[3 * size_t(next)];
  const Vec3 corner[3] = {first.a, first.a + first.edge_b, first.a + first.edge_c};
  const Vec3 other[3] = {patch.a, patch.a + patch.edge_b, patch.a + patch.edge_c};
  for (uint8_t apex = 0; apex < 3; ++apex) {
    const uint8_t b = (apex + 1) % 3, c = (apex + 2) % 3;
    for (uint8_t far = 0; far < 3; ++far) {
      // Neighbours wind alike, so they run through their common edge in opposite directions.
      const uint8_t at_c = (far + 1) % 3, at_b = (far + 2) % 3;
      if (v[b] != w[at_b] || v[c] != w[at_c]) continue;
      const Vec3 edge_b = corner[b] - corner[apex], edge_c = corner[c] - corner[apex];
      const float size2 = glm::dot(edge_b, edge_b) + glm::dot(edge_c, edge_c);
      const Vec3 gap = corner[apex] + edge_b + edge_c - other[far];
      const bool square = std::fabs(glm::dot(edge_b, edge_c)) < 1e-5f * glm::length(edge_b) * glm::length(edge_c);
      if (!square || glm::dot(gap, gap) > 1e-10f * size2) return false;
      first.a = corner[apex], first.edge_b = edge_b, first.edge_c = edge_c;
      first.second = next;
      const uint8_t corners[2][3] = {{apex, b, c}, {far, at_b, at_c}};
      std::copy(&corners[0][0], &corners[0][0] + 6, &first.corners[0][0]);
      return true;
    }
  }
  return false;
}

}  // namespace

bool sample_patch(const EmissivePatch& t, const Vec3& position, const Vec3& normal, const Vec2& u, PatchSample& out) {
  Vec2 p;  // share of the edges
  out.density = 0.0f;
  if (t.rectangle()) {
    p = u;
    if (near_patch(t, position)) {
      const RectangleView view(position, t.a, t.edge_b, t.edge_c);
      if (view.usable()) {
        const CosineWarp warp = rectangle_warp(t, position, normal);
        float factor;
        const Vec2 warped = warp.sample(u, factor);
        p = view.sample(warped);
        out.density = factor / view.solid_angle();
      }
    }
    const bool beyond = p.x + p.y > 1.0f;
    out.triangle = beyond ? t.second : t.triangle;
    const uint8_t* corner = t.corners[beyond];
    float weight[3];
    weight[corner[0]] = beyond ? p.x + p.y - 1.0f : 1.0f - p.x - p.y;
    weight[corner[1]] = beyond ? 1.0f - p.y : p.x;
    weight[corner[2]] = beyond ? 1.0f - p.x : p.y;
    out.barycentric = {weight[1], weight[2]};
  } else {
    const Vec3 a = t.a - position, b = a + t.edge_b, c = a + t.edge_c;
    float angle = 0.0f;
    if (near_patch(t, position) && triangle_by_angle(a, b, c, angle)) {
      p = sample_spherical_triangle(a, b, c, u);
      out.density = 1.0f / angle;
    } else {
      const float root = std::sqrt(u.x);
      p = {1.0f - root, u.y * root};
    }
    out.triangle = t.triangle;
    out.barycentric = p;
  }
  const Vec3 to_point = (t.a - position) + p.x * t.edge_b + p.y * t.edge_c;
  const float d2 = glm::dot(to_point, to_point);
  if (!(d2 > 0.0f)) return false;
  out.distance = std::sqrt(d2);
  out.direction = to_point / out.distance;
  out.margin = margin_of(t, out.direction, out.distance);
  if (out.density > 0.0f) return true;
  const float projected = projected_area(t, out.direction);
  if (!(projected > 0.0f)) return false;
  out.density = d2 / projected;
  return std::isfinite(out.density);
}

float patch_density(const EmissivePatch& t, const Vec3& position, const Vec3& normal, const Vec3& direction,
                    float distance) {
  if (near_patch(t, position)) {
    if (t.rectangle()) {
      const RectangleView view(position, t.a, t.edge_b, t.edge_c);
      if (view.usable()) {
        const Vec3 offset = direction * distance - (t.a - position);
        const Vec2 p(glm::dot(offset, t.edge_b) / glm::dot(t.edge_b, t.edge_b),
                     glm::dot(offset, t.edge_c) / glm::dot(t.edge_c, t.edge_c));
        const CosineWarp warp = rectangle_warp(t, position, normal);
        return warp.flat() ? 1.0f / view.solid_angle() : warp.density(view.invert(p)) / view.solid_angle();
      }
    } else {
      const Vec3 a = t.a - position;
      float angle;
      if (triangle_by_angle(a, a + t.edge_b, a + t.edge_c, angle)) return 1.0f / angle;
    }
  }
  const float projected = projected_area(t, direction);
  return projected > 0.0f ? distance * distance / projected : 0.0f;
}

namespace {

bool has_emitting_slot(const InstanceRecord& record, std::span<const uint32_t> slots, const Materials& materials) {
  if (!record.mesh || record.mesh->triangles.empty()) return false;
  for (uint32_t s = 0; s < record.slot_count; ++s)
    if (materials.emits(slots[record.first_material + s])) return true;
  return false;
}

}  // namespace

bool EmissiveMeshes::touched_by(const SceneChanges& changes, const Scene& scene, const Materials& materials) const {
  std::unordered_set<Handle> meshes, instances;
  for (const auto* list : {&changes.meshes_added, &changes.meshes_deformed, &changes.meshes_replaced})
    meshes.insert(list->begin(), list->end());
  for (const auto* list : {&changes.instances_added, &changes.instances_edited, &changes.instances_removed})
    instances.insert(list->begin(), list->end());
  for (const MovedInstance& moved : changes.instances_moved) instances.insert(moved.instance);
  if (std::ranges::any_of(instances, [&](Handle handle) { return sources_.contains(handle); })) return true;
  if (meshes.empty() && instances.empty()) return false;
  const auto slots = scene.material_slots();
  return std::ranges::any_of(scene.instances(), [&](const InstanceRecord& record) {
    return (instances.contains(record.handle) || meshes.contains(record.mesh_handle)) &&
           (sources_.contains(record.handle) || has_emitting_slot(record, slots, materials));
  });
}

void EmissiveMeshes::collect(const Scene& scene, const Materials& materials) {
  patches_.clear();
  ranges_.clear();
  sources_.clear();
  const auto instances = scene.instances();
  const auto slots = scene.material_slots();
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const InstanceRecord& record = instances[i];
    if (!has_emitting_slot(record, slots, materials)) continue;
    sources_.insert(record.handle);
    const Mesh& mesh = *record.mesh;
    Range range{uint32_t(patches_.size()), 0, 0};
    uint32_t triangles = 0, rectangles = 0;
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      EmissivePatch patch;
      if (!make_patch(scene, materials, record, i, t, patch)) continue;
      ++triangles;
      const bool follows =
          patches_.size() > range.first && patches_.back().triangle + 1 == t && !patches_.back().rectangle();
      if (follows && unite(mesh, patches_.back(), t, patch))
        ++rectangles;
      else
        patches_.push_back(patch);
    }
    range.count = uint32_t(patches_.size()) - range.first;
    if (triangles == mesh.triangle_count()) range.even = rectangles == 0 ? 1 : 2 * rectangles == triangles ? 2 : 0;
    if (range.count) ranges_[i] = range;
  }
}

uint32_t EmissiveMeshes::find(uint32_t instance, uint32_t triangle) const {
  const auto it = ranges_.find(instance);
  if (it == ranges_.end()) return kNone;
  const Range& range = it->second;
  if (range.even) return triangle / range.even < range.count ? range.first + triangle / range.even : kNone;
  const auto begin = patches_.begin() + range.first, end = begin + range.count;
  auto found =
      std::upper_bound(begin, end, triangle, [](uint32_t x, const EmissivePatch& p) { return x < p.triangle; });
  if (found == begin) return kNone;
  --found;
  return found->triangle == triangle || found->second == triangle ? uint32_t(found - patches_.begin()) : kNone;
}

LightBounds EmissiveMeshes::bounds(uint32_t index, const Rgb& mean_radiance) const {
  const EmissivePatch& t = patches_[index];
  const Vec3 n = glm::cross(t.edge_b, t.edge_c);
  const float length = glm::length(n);
  LightBounds bounds;
  bounds.box.extend(t.a);
  bounds.box.extend(t.a + t.edge_b);
  bounds.box.extend(t.a + t.edge_c);
  if (t.rectangle()) bounds.box.extend(t.a + t.edge_b + t.edge_c);
  bounds.axis = length > 0.0f ? n / length : Vec3(0, 0, 1);
  bounds.cos_normals = 1.0f, bounds.cos_emission = 0.0f;
  bounds.two_sided = true;
  bounds.intensity = (t.rectangle() ? 1.0f : 0.5f) * length * std::max(luminance(mean_radiance), 0.0f);
  if (!std::isfinite(bounds.intensity)) bounds.intensity = 0.0f;
  return bounds;
}

}  // namespace afterglow
