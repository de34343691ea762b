// SPDX-License-Identifier: GPL-3.0-or-later
// Instructions that read the hit: coordinates, geometry, attributes, the path, and normals from maps and bumps (Blinn
// 1978; Mikkelsen 2010, the surface gradient).
#include <algorithm>

#include "materials/attributes.h"
#include "materials/closures.h"

namespace afterglow {
namespace {

const InstanceRecord* instance_of(const HitContext& hit, const SurfacePoint& point) {
  if (!hit.scene || point.instance >= hit.scene->instances().size()) return nullptr;
  const InstanceRecord& record = hit.scene->instances()[point.instance];
  return record.mesh ? &record : nullptr;
}

Vec3 unit_or(const Vec3& v, const Vec3& otherwise) {
  const float length = glm::length(v);
  return length > 0.0f && std::isfinite(length) ? v / length : otherwise;
}

Vec3 world_position(const HitContext& hit, const SurfacePoint& p) {
  return hit.scene && !hit.background ? p.position + Vec3(hit.scene->origin()) : p.position;
}

Vec3 object_position(const HitContext& hit, const SurfacePoint& p) {
  const InstanceRecord* record = instance_of(hit, p);
  return record ? record->to_object.point(p.position) : p.position;
}

Vec3 object_normal(const HitContext& hit, const SurfacePoint& p, const Vec3& n) {
  const InstanceRecord* record = instance_of(hit, p);
  return record ? unit_or(record->to_world.transposed(n), n) : n;
}

Vec3 generated(const HitContext& hit, const SurfacePoint& p) {
  const InstanceRecord* record = instance_of(hit, p);
  if (!record) return p.position;
  if (hit.attributes) {
    if (const AttributeSlot* slot = hit.attributes->find(p.instance, hit.attributes->generated)) {
      return Vec3(interpolate(*slot, *record->mesh, p));
    }
  }
  const Vec3 q = record->to_object.point(p.position), low = record->mesh->bounds.lower,
             size = record->mesh->bounds.size();
  const auto axis = [](float v, float base, float extent) {
    return extent > 0.0f ? (v - base) / extent : v - base + 0.5f;
  };
  return {axis(q.x, low.x, size.x), axis(q.y, low.y, size.y), axis(q.z, low.z, size.z)};
}

/// Rows of a camera's inverse: where a world point lies in front of it (z forwards).
Vec3 camera_position(const HitContext& hit, const Vec3& relative, bool direction) {
  if (!hit.scene) return relative;
  const DMat4& m = hit.scene->camera().transform;
  const DVec3 p = DVec3(relative) + (direction ? DVec3(0.0) : hit.scene->origin() - DVec3(m[3]));
  const auto along = [&](int k) {
    return glm::dot(p, DVec3(m[k])) / std::max(glm::dot(DVec3(m[k]), DVec3(m[k])), 1e-30);
  };
  return {float(along(0)), float(along(1)), float(-along(2))};
}

Vec3 from_camera(const HitContext& hit, const Vec3& v, bool direction) {
  if (!hit.scene) return v;
  const DMat4& m = hit.scene->camera().transform;
  const DVec3 w = DVec3(m[0]) * double(v.x) + DVec3(m[1]) * double(v.y) - DVec3(m[2]) * double(v.z);
  return Vec3(direction ? w : w + DVec3(m[3]) - hit.scene->origin());
}

Vec3 window_position(const HitContext& hit, const SurfacePoint& p) {
  if (!hit.scene) return p.position;
  const Vec3 q = camera_position(hit, p.position, hit.background);
  const Camera& camera = hit.scene->camera();
  const float z = camera.kind == CameraKind::kPerspective ? std::max(q.z, 1e-20f) : 1.0f;
  const Vec4& w = camera.window;
  return {(q.x / z - w.x) / (w.y - w.x), (q.y / z - w.z) / (w.w - w.z), 0.0f};
}

enum Coordinate : uint32_t { kGenerated, kNormal, kObject, kCamera, kWindow, kReflection };

Vec3 tex_coord(const Operands& in, const HitContext& hit) {  // coordinate, offset, has matrix, 12 floats
  const SurfacePoint& p = *hit.points[in.u(1)];
  switch (in.u(0)) {
    case kGenerated:
      return generated(hit, p);
    case kNormal:
      return object_normal(hit, p, p.normal);
    case kObject: {
      if (!in.u(2)) return object_position(hit, p);
      const Vec3 w = world_position(hit, p);
      const auto row = [&](int k) {
        return in.p(3 + k * 4) * w.x + in.p(4 + k * 4) * w.y + in.p(5 + k * 4) * w.z + in.p(6 + k * 4);
      };
      return {row(0), row(1), row(2)};
    }
    case kCamera:
      return camera_position(hit, p.position, hit.background);
    case kWindow:
      return window_position(hit, p);
    default:
      return hit.background ? p.position : p.normal * (2.0f * glm::dot(p.normal, p.outgoing)) - p.outgoing;
  }
}

Vec3 attribute(const Operands& in, const HitContext& hit, Vec3* alpha) {  // number, offset
  const SurfacePoint& p = *hit.points[in.u(1)];
  const InstanceRecord* record = instance_of(hit, p);
  const AttributeSlot* slot = record && hit.attributes ? hit.attributes->find(p.instance, in.u(0)) : nullptr;
  if (!slot) return Vec3(0.0f);
  const Vec4 value = interpolate(*slot, *record->mesh, p);
  *alpha = Vec3(value.w);
  return Vec3(value);
}

Vec3 geometry(const Operands& in, const HitContext& hit) {  // which, offset
  const SurfacePoint& p = *hit.points[in.u(1)];
  switch (in.u(0)) {
    case 0:
      return world_position(hit, p);
    case 1:
      return p.normal;
    case 2:
      return default_tangent(hit);
    case 3:
      return p.face_normal;
    case 4:
      return p.outgoing;
    case 5:
      return {p.u, p.v, 0.0f};
    case 6:
      return Vec3(p.backfacing ? 1.0f : 0.0f);
    default:
      return Vec3(0.5f);
  }
}

Vec3 light_path(uint32_t which, const PathContext* path) {
  if (!path) return Vec3(which == 0 ? 1.0f : 0.0f);
  const auto bit = [&](uint32_t kind) { return Vec3((path->kind & kind) ? 1.0f : 0.0f); };
  switch (which) {
    case 0:
      return bit(PathContext::kCamera);
    case 1:
      return bit(PathContext::kShadow);
    case 2:
      return bit(PathContext::kDiffuse);
    case 3:
      return bit(PathContext::kGlossy);
    case 4:
      return bit(PathContext::kSingular);
    case 5:
      return bit(PathContext::kReflection);
    case 6:
      return bit(PathContext::kTransmission);
    case 7:
      return Vec3(path->ray_length);
    case 8:
      return Vec3(path->depth);
    case 9:
      return Vec3(path->diffuse_depth);
    case 10:
      return Vec3(path->glossy_depth);
    case 11:
      return Vec3(path->transparent_depth);
    default:
      return Vec3(path->transmission_depth);
  }
}

Vec3 object_info(uint32_t which, const HitContext& hit) {
  const InstanceRecord* record = instance_of(hit, *hit.points[0]);
  switch (which) {
    case 0:
      return record ? record->to_world.p + Vec3(hit.scene->origin()) : Vec3(0.0f);
    case 1:
      return record ? Vec3(record->color) : Vec3(1.0f);
    case 2:
      return Vec3(record ? record->color.w : 1.0f);
    case 3:
      return Vec3(record ? float(record->object_index) : 0.0f);
    case 4:
      return Vec3(float(hit.material_index));
    default:
      return Vec3(record ? record->random : 0.0f);
  }
}

/// Tangent of a UV map at the hit's triangle, at right angles to the normal; sign: handedness. For meshes
/// that bring no tangents of their own.)
bool uv_tangent(const HitContext& hit, uint32_t number, const Vec3& normal, Vec3& tangent, float& sign) {
  const SurfacePoint& p = *hit.points[0];
  const InstanceRecord* record = instance_of(hit, p);
  if (!record) return false;
  const Mesh& mesh = *record->mesh;
  Vec2 uv[3];
  if (number != kNone) {
    const AttributeSlot* slot = hit.attributes ? hit.attributes->find(p.instance, number) : nullptr;
    if (!slot) return false;
    corner_values(*slot, mesh, p.triangle, uv);
  } else {
    if (mesh.active_uv >= mesh.uvs.size()) return false;
    corner_values({&mesh.uvs[mesh.active_uv].values.front().x, 2, Domain::kCorner}, mesh, p.triangle, uv);
  }
  const uint32_t* v = &mesh.triangles[3 * p.triangle];
  const Vec3 e1 = record->to_world.vector(mesh.positions[v[1]] - mesh.positions[v[0]]);
  const Vec3 e2 = record->to_world.vector(mesh.positions[v[2]] - mesh.positions[v[0]]);
  const Vec2 d1 = uv[1] - uv[0], d2 = uv[2] - uv[0];
  const float area = d1.x * d2.y - d2.x * d1.y;
  if (area == 0.0f) return false;
  const Vec3 along = (e1 * d2.y - e2 * d1.y) / area, across = (e2 * d1.x - e1 * d2.x) / area;
  const Vec3 flat = along - normal * glm::dot(normal, along);
  tangent = unit_or(flat, Vec3(0.0f));
  sign = glm::dot(glm::cross(normal, tangent), across) < 0.0f ? -1.0f : 1.0f;
  return glm::dot(tangent, tangent) > 0.0f;
}

Vec3 normal_map(const Instruction& ins, const Operands& in, const HitContext& hit) {  // strength, colour; space, uv
  const SurfacePoint& p = *hit.points[0];
  const float strength = std::max(in.at(ins.a).x, 0.0f);
  Vec3 c = in.at(ins.b) * 2.0f - 1.0f;
  const float turn = p.backfacing ? -1.0f : 1.0f;
  const uint32_t space = in.u(0);
  if (space == 0) {
    Vec3 tangent;
    float sign;
    const Vec3 n = p.normal * turn;
    const AttributeSlot* corners = hit.attributes ? hit.attributes->find(p.instance, in.u(3)) : nullptr;
    if (corners) {  // in object space, where they were made
      const InstanceRecord& record = *instance_of(hit, p);
      const Vec4 t = interpolate(*corners, *record.mesh, p);
      const Vec3 own = unit_or(record.to_world.transposed(n), n), along(t);
      c.x *= strength, c.y *= strength;
      c.z = 1.0f + (c.z - 1.0f) * saturate(strength);
      const Vec3 mapped = along * c.x + glm::cross(own, along) * (t.w * c.y) + own * c.z;
      return unit_or(record.to_object.transposed(unit_or(mapped, own)), n) * turn;
    }
    if (!uv_tangent(hit, in.u(1), n, tangent, sign)) return p.normal;
    c.x *= strength, c.y *= strength;
    c.z = 1.0f + (c.z - 1.0f) * saturate(strength);
    const Vec3 mapped = tangent * c.x + glm::cross(n, tangent) * (sign * c.y) + n * c.z;
    return unit_or(mapped, n) * turn;
  }
  if (space >= 3) c.y = -c.y, c.z = -c.z;
  Vec3 n = c;
  if (space == 1 || space == 3) {
    if (const InstanceRecord* record = instance_of(hit, p)) n = record->to_object.transposed(c);
  }
  n = unit_or(n, p.normal * turn) * turn;
  return unit_or(p.normal + (n - p.normal) * strength, p.normal);
}

Vec3 bump(const Instruction& ins, const Operands& in,
          const HitContext& hit) {  // h0, h1, h2; strength, distance, normal; sign
  const SurfacePoint& p = *hit.points[0];
  if (!hit.points[1]) return p.normal;
  const Vec3 n = in.given(2) ? unit_or(in.v(2), p.normal) : p.normal;
  const Vec3 dx = hit.points[1]->position - p.position, dy = hit.points[2]->position - p.position;
  const Vec3 rx = glm::cross(dy, n), ry = glm::cross(n, dx);
  const float det = glm::dot(dx, rx), strength = std::max(in.f(0), 0.0f), distance = in.f(1) * in.p(3);
  const Vec3 gradient = rx * (in.at(ins.b).x - in.at(ins.a).x) + ry * (in.at(ins.c).x - in.at(ins.a).x);
  const Vec3 bent = n * std::fabs(det) - gradient * (det < 0.0f ? -distance : distance);
  return unit_or(lerp(n, unit_or(bent, n), strength), n);
}

/// Before Blender 4.0 these nodes themselves kept the mirror direction above the surface, for diffuse lobes, too.
Vec3 bent_normal(const Vec3& n, uint32_t version, const SurfacePoint& p) {
  return version == 1 ? reflecting_normal(n, p.face_normal, p.outgoing) : n;
}

Vec3 vector_transform(const Operands& in, const HitContext& hit, Vec3 v) {  // kind, from, to
  const uint32_t kind = in.u(0), from = in.u(1), to = in.u(2);              // 0 world, 1 object, 2 camera
  const InstanceRecord* record = instance_of(hit, *hit.points[0]);
  const bool point = kind == 1, normal = kind == 2;
  const Vec3 origin = hit.scene ? Vec3(hit.scene->origin()) : Vec3(0.0f);
  if (from == to) return v;
  if (from == 0 && point) v -= origin;
  if (from == 1 && record) {
    v = point ? record->to_world.point(v) : normal ? record->to_object.transposed(v) : record->to_world.vector(v);
  }
  if (from == 2) v = from_camera(hit, v, !point);
  if (to == 1 && record) {
    v = point ? record->to_object.point(v) : normal ? record->to_world.transposed(v) : record->to_object.vector(v);
  }
  if (to == 2) v = camera_position(hit, v, !point);
  if (to == 0 && point) v += origin;
  return normal ? unit_or(v, v) : v;
}

Vec3 wireframe(const Instruction& ins, const HitContext& hit, const Operands& in) {  // size; in pixels
  const SurfacePoint& p = *hit.points[0];
  const InstanceRecord* record = instance_of(hit, p);
  if (!record) return Vec3(0.0f);
  const uint32_t* v = &record->mesh->triangles[3 * p.triangle];
  Vec3 corner[3];
  for (int k = 0; k < 3; ++k) corner[k] = record->to_world.point(record->mesh->positions[v[k]]);
  const float size = in.at(ins.a).x * (in.u(0) ? p.t * 1e-3f : 1.0f) * 0.5f;
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = corner[(k + 1) % 3] - corner[k];
    const float length = glm::length(edge);
    if (length > 0.0f && glm::length(glm::cross(p.position - corner[k], edge)) / length < size) return Vec3(1.0f);
  }
  return Vec3(0.0f);
}

}  // namespace

Vec3 default_tangent(const HitContext& hit) {
  const SurfacePoint& p = *hit.points[0];
  const Vec3 g = generated(hit, p);
  Vec3 t(-(g.y - 0.5f), g.x - 0.5f, 0.0f);
  if (const InstanceRecord* record = instance_of(hit, p)) t = record->to_world.vector(t);
  const Vec3 side = unit_or(glm::cross(t, p.normal), Vec3(0.0f));
  return unit_or(glm::cross(p.normal, side), Frame(p.normal).t);
}

Vec3 read_hit(const Instruction& ins, const Operands& in, const HitContext& hit, Vec3* second) {
  const SurfacePoint& p = *hit.points[0];
  switch (ins.op) {
    case Op::kTexCoord:
      return tex_coord(in, hit);
    case Op::kUv:
      return Vec3(hit.points[in.u(0)]->uv, 0.0f);
    case Op::kAttribute:
      return attribute(in, hit, second);
    case Op::kGeometry:
      return geometry(in, hit);
    case Op::kLightPath:
      return light_path(in.u(0), hit.path);
    case Op::kObjectInfo:
      return object_info(in.u(0), hit);
    case Op::kCamera: {
      const Vec3 q = camera_position(hit, p.position, hit.background);
      *second = Vec3(in.u(0) ? glm::length(q) : std::fabs(q.z));
      return unit_or(q, Vec3(0, 0, 1));
    }
    case Op::kNormalMap:
      return bent_normal(normal_map(ins, in, hit), in.u(2), p);
    case Op::kBump:
      return bent_normal(bump(ins, in, hit), in.u(4), p);
    case Op::kFresnel: {
      const float eta = std::max(in.at(ins.a).x, 1e-5f);
      const Vec3 n = ins.b == kNoOperand ? p.normal : unit_or(in.at(ins.b), p.normal);
      return Vec3(fresnel_dielectric(std::fabs(glm::dot(n, p.outgoing)), p.backfacing ? 1.0f / eta : eta));
    }
    case Op::kLayerWeight: {
      const Vec3 n = ins.b == kNoOperand ? p.normal : unit_or(in.at(ins.b), p.normal);
      const float cosine = std::min(std::fabs(glm::dot(n, p.outgoing)), 1.0f), mix = in.at(ins.a).x;
      const float eta = std::max(1.0f - mix, 1e-5f), b = std::clamp(mix, 0.0f, 1.0f - 1e-5f);
      const float power = b < 0.5f ? 2.0f * b : 0.5f / (1.0f - b);
      *second = Vec3(1.0f - (mix == 0.5f ? cosine : std::pow(cosine, power)));
      return Vec3(fresnel_dielectric(cosine, p.backfacing ? eta : 1.0f / eta));
    }
    case Op::kVectorTransform:
      return vector_transform(in, hit, in.at(ins.a));
    case Op::kTangent: {
      if (in.u(0) == 0) {  // of a UV map
        Vec3 t;
        float sign;
        if (uv_tangent(hit, in.u(1), p.normal, t, sign)) return t;
        return default_tangent(hit);
      }
      const Vec3 g = generated(hit, p) - 0.5f;
      Vec3 t = in.u(1) == 0 ? Vec3(0, -g.z, g.y) : in.u(1) == 1 ? Vec3(-g.z, 0, g.x) : Vec3(-g.y, g.x, 0);
      if (const InstanceRecord* record = instance_of(hit, p)) t = record->to_world.vector(t);
      return unit_or(glm::cross(p.normal, unit_or(glm::cross(t, p.normal), Vec3(0.0f))), t);
    }
    case Op::kWireframe:
      return wireframe(ins, hit, in);
    default:
      return Vec3(0.0f);
  }
}

}  // namespace afterglow
