// SPDX-License-Identifier: GPL-3.0-or-later
// What moved, and the tests that spare rays: see moved.h. The slab test with an interval of origins is conservative: a
// ray that it rejects meets the box from nowhere within the interval.
#include "methods/instant_cache/moved.h"

#include <algorithm>

namespace afterglow::instant_cache {

namespace {

constexpr uint32_t kMostParts = 64;  // of a mesh
constexpr float kFar = 1e37f;        // where boxes stand that no ray meets

bool same(const Affine& a, const Affine& b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.p == b.p; }

Box widened(const Box& box, float share, float least) {
  const Vec3 by = share * glm::max(box.size(), glm::max(glm::abs(box.lower), glm::abs(box.upper))) + least;
  return {box.lower - by, box.upper + by};
}

/// The parts are the triangles whose middles lie in a cell of a grid of cubes over the mesh: as many as kMostParts
/// allows, so that a long thing is cut along its length. One pass over the triangles.
std::shared_ptr<const Parts> parts_of(const Mesh& mesh) {
  const Vec3 size = mesh.bounds.size();
  float cell = max_component(size) / 16.0f;
  if (!(cell > 0.0f) || !std::isfinite(cell)) return nullptr;
  const auto cells_along = [&](int axis) { return std::max(uint32_t(std::ceil(size[axis] / cell)), 1u); };
  while (cells_along(0) * cells_along(1) * cells_along(2) > kMostParts) cell *= 1.2f;
  const uint32_t nx = cells_along(0), ny = cells_along(1), nz = cells_along(2);
  std::vector<Box> boxes(size_t(nx) * ny * nz);
  for (size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
    if (mesh.triangles[t] == mesh.triangles[t + 1] && mesh.triangles[t] == mesh.triangles[t + 2]) continue;  // left out
    const Vec3 &a = mesh.positions[mesh.triangles[t]], &b = mesh.positions[mesh.triangles[t + 1]],
               &c = mesh.positions[mesh.triangles[t + 2]];
    const Vec3 at = ((a + b + c) / 3.0f - mesh.bounds.lower) / cell;
    const auto index = [](float x, uint32_t n) { return std::min(uint32_t(std::max(x, 0.0f)), n - 1); };
    Box& box = boxes[index(at.x, nx) + nx * (index(at.y, ny) + ny * index(at.z, nz))];
    box.extend(a), box.extend(b), box.extend(c);
  }
  std::erase_if(boxes, [](const Box& box) { return box.empty(); });
  if (boxes.size() < 2) return nullptr;
  auto parts = std::make_shared<Parts>();
  for (int axis = 0; axis < 3; ++axis) {
    parts->lower[axis].assign((boxes.size() + 7) / 8 * 8, kFar);
    parts->upper[axis].assign(parts->lower[axis].size(), kFar);
  }
  for (size_t i = 0; i < boxes.size(); ++i) {
    const Box box = widened(boxes[i], 2e-5f, 1e-5f * max_component(size));
    for (int axis = 0; axis < 3; ++axis)
      parts->lower[axis][i] = box.lower[axis], parts->upper[axis][i] = box.upper[axis];
  }
  return parts;
}

Bounds bounds_of(const InstanceRecord& record) {
  Bounds bounds;
  bounds.to_object = record.to_object;
  if (record.mesh->bounds.empty()) return bounds;
  bounds.box = widened(record.mesh->bounds, 2e-5f, 1e-5f * max_component(record.mesh->bounds.size()));
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at(corner & 1 ? bounds.box.upper.x : bounds.box.lower.x,
                  corner & 2 ? bounds.box.upper.y : bounds.box.lower.y,
                  corner & 4 ? bounds.box.upper.z : bounds.box.lower.z);
    bounds.world.extend(record.to_world.point(at));
  }
  bounds.world = widened(bounds.world, 2e-5f, 0.0f);
  return bounds;
}

}  // namespace

std::vector<Moved> Placement::update(const CommittedScene& committed, const SceneChanges& changes) {
  const Scene& scene = committed.scene;
  const auto records = scene.instances();
  const auto contains = [](const std::vector<Handle>& list, Handle handle) {
    return std::find(list.begin(), list.end(), handle) != list.end();
  };
  std::vector<uint8_t> edited(scene.material_handles().size(), !changes.images_edited.empty());
  for (const auto* list : {&changes.materials_edited, &changes.materials_added})
    for (const Handle handle : *list)
      if (const uint32_t index = scene.material_index(handle); index < edited.size()) edited[index] = 1;
  std::vector<Moved> moved;
  std::unordered_map<Handle, std::shared_ptr<const Parts>> made;
  const size_t count = std::max(records.size(), objects_.size());
  objects_.resize(count);
  for (uint32_t i = 0; i < count; ++i) {
    Object now;
    if (i < records.size() && records[i].mesh && !records[i].mesh->triangles.empty()) {
      const InstanceRecord& r = records[i];
      now.handle = r.handle, now.mesh = r.mesh_handle, now.to_world = r.to_world;
      now.visibility = r.visibility & kVisibleDiffuse;
      for (uint32_t s = 0; s < r.slot_count; ++s) {
        now.materials.push_back(scene.material_slots()[r.first_material + s]);
        now.lets_light_through |= !committed.materials.opaque(now.materials.back());
      }
    }
    Object& before = objects_[i];
    const bool mesh_stays = before.handle == now.handle && before.mesh == now.mesh && now.handle;
    const bool deformed = mesh_stays && contains(changes.meshes_deformed, now.mesh);
    const bool replaced = mesh_stays && contains(changes.meshes_replaced, now.mesh);
    const bool placed_otherwise = !mesh_stays || deformed || replaced || !same(before.to_world, now.to_world);
    bool lets_through_otherwise =
        before.visibility != now.visibility || before.lets_light_through != now.lets_light_through;
    if (before.lets_light_through || now.lets_light_through) {
      lets_through_otherwise |= before.materials != now.materials || contains(changes.instances_edited, now.handle);
      for (const uint32_t m : now.materials) lets_through_otherwise |= edited[m] != 0;
    }
    if (!before.handle && !now.handle) continue;
    now.bounds = !placed_otherwise ? before.bounds : now.handle ? bounds_of(records[i]) : Bounds{};
    if (placed_otherwise || lets_through_otherwise) {
      const bool keeps = mesh_stays && !replaced;
      if (placed_otherwise && mesh_stays) {  // what moved once may move again; others need no parts
        const bool shape_stays = !deformed && !replaced;
        std::shared_ptr<const Parts> parts = shape_stays ? before.bounds.parts : nullptr;
        if (!parts) {
          std::shared_ptr<const Parts>& known = made[now.mesh];
          if (!known) known = parts_of(*records[i].mesh);
          parts = known;
        }
        now.bounds.parts = parts;
        if (shape_stays) before.bounds.parts = parts;
      }
      moved.push_back({i, before.handle ? before.bounds : Bounds{}, now.bounds, keeps, !placed_otherwise});
    }
    before = std::move(now);
  }
  objects_.resize(records.size());
  return moved;
}

void crossing(const Bounds& bounds, const Vec3& from, float slack, const float* x, const float* y, const float* z,
              uint32_t count, uint64_t* bits) {
  const Vec3 o = bounds.to_object.point(from);
  const Affine& m = bounds.to_object;
  const Box& b = bounds.box;
  const Vec3 reach = slack * (glm::abs(m.x) + glm::abs(m.y) + glm::abs(m.z));
  const Vec3 below = b.lower - reach - o, above = b.upper + reach - o;
  for (uint32_t first = 0; first < count; first += 64) {
    const uint32_t here = std::min(count - first, 64u);
    uint8_t hits[64];
    for (uint32_t k = 0; k < here; ++k) {
      const float dx = x[first + k] - from.x, dy = y[first + k] - from.y, dz = z[first + k] - from.z;
      float enter = 0.0f, leave = 1.0f;
      for (int axis = 0; axis < 3; ++axis) {
        float d = m.x[axis] * dx + m.y[axis] * dy + m.z[axis] * dz;
        d = std::fabs(d) < 1e-30f ? 1e-30f : d;
        const float inverse = 1.0f / d;
        const float t0 = below[axis] * inverse, t1 = above[axis] * inverse;
        enter = std::max(enter, std::min(t0, t1));
        leave = std::min(leave, std::max(t0, t1));
      }
      hits[k] = enter <= leave * (1.0f + 1e-5f) + 1e-6f;
    }
    uint64_t word = 0;
    for (uint32_t k = 0; k < here; ++k) word |= uint64_t(hits[k]) << k;
    bits[first / 64] = word;
  }
}

bool crosses_parts(const Bounds& bounds, const Vec3& from, const Vec3& to, float slack) {
  if (!bounds.parts) return true;
  const Affine& m = bounds.to_object;
  const Vec3 o = m.point(from), end = m.point(to);
  const Vec3 reach = slack * (glm::abs(m.x) + glm::abs(m.y) + glm::abs(m.z));
  Vec3 inverse;
  for (int axis = 0; axis < 3; ++axis) {
    const float d = end[axis] - o[axis];
    inverse[axis] = 1.0f / (std::fabs(d) < 1e-30f ? 1e-30f : d);
  }
  const Parts& p = *bounds.parts;
  const float *lx = p.lower[0].data(), *ly = p.lower[1].data(), *lz = p.lower[2].data();
  const float *ux = p.upper[0].data(), *uy = p.upper[1].data(), *uz = p.upper[2].data();
  const size_t count = p.lower[0].size();
  for (size_t first = 0; first < count; first += 8) {
    uint32_t any = 0;
    for (size_t i = first; i < first + 8; ++i) {
      const float x0 = (lx[i] - reach.x - o.x) * inverse.x, x1 = (ux[i] + reach.x - o.x) * inverse.x;
      const float y0 = (ly[i] - reach.y - o.y) * inverse.y, y1 = (uy[i] + reach.y - o.y) * inverse.y;
      const float z0 = (lz[i] - reach.z - o.z) * inverse.z, z1 = (uz[i] + reach.z - o.z) * inverse.z;
      const float enter = std::max(std::max(std::min(x0, x1), std::min(y0, y1)), std::max(std::min(z0, z1), 0.0f));
      const float leave = std::min(std::min(std::max(x0, x1), std::max(y0, y1)), std::min(std::max(z0, z1), 1.0f));
      any |= uint32_t(enter <= leave * (1.0f + 1e-5f) + 1e-6f);
    }
    if (any) return true;
  }
  return false;
}

void crossing_from_box(const Box& moved, const Box& from, const float* x, const float* y, const float* z,
                       uint32_t count, uint64_t* bits) {
  for (uint32_t first = 0; first < count; first += 64) {
    const uint32_t here = std::min(count - first, 64u);
    uint64_t word = 0;
    for (uint32_t k = 0; k < here; ++k) {
      const Vec3 light(x[first + k], y[first + k], z[first + k]);
      // At s the ways fill the box from (1 − s) from + s light: it must meet `moved` on every axis at once.
      float enter = 0.0f, leave = 1.0f;
      for (int axis = 0; axis < 3; ++axis) {
        const float low_slope = light[axis] - from.lower[axis], low = moved.upper[axis] - from.lower[axis];
        const float high_slope = light[axis] - from.upper[axis], high = moved.lower[axis] - from.upper[axis];
        // lower(s) = from.lower + s low_slope ≤ moved.upper; upper(s) = from.upper + s high_slope ≥ moved.lower
        if (low_slope > 0.0f)
          leave = std::min(leave, low / low_slope);
        else if (low_slope < 0.0f)
          enter = std::max(enter, low / low_slope);
        else if (low < 0.0f)
          leave = -1.0f;
        if (high_slope < 0.0f)
          leave = std::min(leave, high / high_slope);
        else if (high_slope > 0.0f)
          enter = std::max(enter, high / high_slope);
        else if (high > 0.0f)
          leave = -1.0f;
      }
      word |= uint64_t(enter <= leave * (1.0f + 1e-5f) + 1e-6f) << k;
    }
    bits[first / 64] = word;
  }
}

}  // namespace afterglow::instant_cache
