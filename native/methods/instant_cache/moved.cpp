// SPDX-License-Identifier: GPL-3.0-or-later
// What moved, and the tests that spare rays: see moved.h. A way from anywhere near a point stays within that distance
// of the way from the point: the box is taken as much larger.
#include "methods/instant_cache/moved.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace afterglow::instant_cache {

namespace {

constexpr uint32_t kMostParts = 64;  // of a mesh
constexpr float kFar = 1e18f;        // where boxes stand that no ray meets
constexpr float kRounding = 1e-6f;   // of lengths and of their products

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
    parts->middle[axis].assign((boxes.size() + 15) / 16 * 16, kFar);
    parts->half[axis].assign(parts->middle[axis].size(), 0.0f);
  }
  for (size_t i = 0; i < boxes.size(); ++i) {
    const Box box = widened(boxes[i], 2e-5f, 1e-5f * max_component(size));
    for (int axis = 0; axis < 3; ++axis)
      parts->middle[axis][i] = box.center()[axis], parts->half[axis][i] = 0.5f * box.size()[axis];
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

bool contains(const std::vector<Handle>& list, Handle handle) {
  return std::find(list.begin(), list.end(), handle) != list.end();
}

/// A byte for each dense material.
std::vector<uint8_t> edited_materials(const Scene& scene, const SceneChanges& changes) {
  std::vector<uint8_t> edited(scene.material_handles().size(), !changes.images_edited.empty());
  for (const auto* list : {&changes.materials_edited, &changes.materials_added})
    for (const Handle handle : *list)
      if (const uint32_t index = scene.material_index(handle); index < edited.size()) edited[index] = 1;
  return edited;
}

}  // namespace

std::vector<Bounds> Placement::repainted(const CommittedScene& committed, const SceneChanges& changes) const {
  const std::vector<uint8_t> edited = edited_materials(committed.scene, changes);
  std::vector<Bounds> found;
  for (const Object& object : objects_) {
    if (!object.handle || !object.bounds.present()) continue;
    const bool any = std::any_of(object.materials.begin(), object.materials.end(),
                                 [&](uint32_t m) { return m < edited.size() && edited[m]; });
    if (any || !changes.materials_removed.empty() || contains(changes.instances_edited, object.handle))
      found.push_back(object.bounds);
  }
  return found;
}

std::vector<Moved> Placement::update(const CommittedScene& committed, const SceneChanges& changes) {
  const Scene& scene = committed.scene;
  const auto records = scene.instances();
  const std::vector<uint8_t> edited = edited_materials(scene, changes);
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
      moved.push_back({i, before.handle ? before.bounds : Bounds{}, now.bounds, keeps, !placed_otherwise,
                       !before.lets_light_through, !now.lets_light_through});
    }
    before = std::move(now);
  }
  objects_.resize(records.size());
  return moved;
}

Crossing::Crossing(const Bounds& bounds, float slack, const VirtualLightColumns& lights)
    : to_object_(bounds.to_object),
      parts_(bounds.parts.get()),
      middle_(bounds.box.center()),
      words_((lights.count + 63) / 64) {
  const Affine& m = to_object_;
  const Vec3 stretch = glm::abs(m.x) + glm::abs(m.y) + glm::abs(m.z);
  reach_ = slack * stretch + kRounding * glm::abs(m.p);
  half_ = 0.5f * bounds.box.size() + reach_;
  to_object_.p -= middle_;
  for (auto* column : {&x_, &y_, &z_}) column->assign(size_t(words_) * 64, 0.0f);
  for (uint32_t k = 0; k < lights.count; ++k) {
    const Vec3 at = to_object_.point(Vec3(lights.x[k], lights.y[k], lights.z[k]));
    x_[k] = at.x, y_[k] = at.y, z_[k] = at.z;
    far_ = std::max(far_, max_component(glm::abs(at)));
  }
}

float Crossing::rounding(const Vec3& from) const {
  const float size = max_component(half_);
  return kRounding * (max_component(glm::abs(from)) + size) * (far_ + size);
}

bool Crossing::box(const Vec3& from, const Vec3& spread, const uint64_t* among, uint64_t* crosses) const {
  const Affine& m = to_object_;
  const Vec3 o = m.point(from);
  const Vec3 e =
      half_ + glm::abs(m.x) * spread.x + glm::abs(m.y) * spread.y + glm::abs(m.z) * spread.z + kRounding * glm::abs(o);
  const Vec3 twice = 2.0f * e;
  const float rest = rounding(o);
  uint64_t any = 0;
  for (uint32_t w = 0; w < words_; ++w) {
    const uint64_t asked = among[w];  // may be the same memory
    crosses[w] = 0;
    if (!asked) continue;
    const float *x = x_.data() + 64 * w, *y = y_.data() + 64 * w, *z = z_.data() + 64 * w;
    uint8_t hits[64];
    for (int k = 0; k < 64; ++k) {
      const float dx = std::fabs(x[k] - o.x), dy = std::fabs(y[k] - o.y), dz = std::fabs(z[k] - o.z);
      const float sx = std::fabs(x[k] + o.x), sy = std::fabs(y[k] + o.y), sz = std::fabs(z[k] + o.z);
      const float cx = std::fabs(o.y * z[k] - o.z * y[k]), cy = std::fabs(o.z * x[k] - o.x * z[k]),
                  cz = std::fabs(o.x * y[k] - o.y * x[k]);
      // Not a number: it may.
      hits[k] = uint8_t(!(sx > twice.x + dx) & !(sy > twice.y + dy) & !(sz > twice.z + dz) &
                        !(cx > e.y * dz + e.z * dy + rest) & !(cy > e.z * dx + e.x * dz + rest) &
                        !(cz > e.x * dy + e.y * dx + rest));
    }
    for (int k = 0; k < 64; k += 8) {
      uint64_t bytes;
      std::memcpy(&bytes, hits + k, 8);
      crosses[w] |= (bytes * 0x0102040810204080ull >> 56) << k;  // a bit a byte
    }
    crosses[w] &= asked;
    any |= crosses[w];
  }
  return any != 0;
}

void Crossing::parts(const Vec3& from, uint64_t* crosses) const {
  if (!parts_) return;
  const Vec3 o = to_object_.point(from);
  const float rest = rounding(o);
  for (uint32_t w = 0; w < words_; ++w)
    for (uint64_t bits = crosses[w]; bits; bits &= bits - 1) {
      const uint32_t k = 64 * w + uint32_t(std::countr_zero(bits));
      if (!meets_part(o, Vec3(x_[k], y_[k], z_[k]), rest)) crosses[w] &= ~(bits & -bits);
    }
}

bool Crossing::meets_part(const Vec3& from, const Vec3& to, float rest) const {
  const Parts& p = *parts_;
  const float *mx = p.middle[0].data(), *my = p.middle[1].data(), *mz = p.middle[2].data();
  const float *hx = p.half[0].data(), *hy = p.half[1].data(), *hz = p.half[2].data();
  const Vec3 way = to - from, d = glm::abs(way), sum = from + to + 2.0f * middle_;
  const Vec3 reach = reach_ + kRounding * (glm::abs(from) + far_);
  // Around the middle of the way: its cross product with the way is that of one end, too.
  const Vec3 a = 0.5f * sum;
  for (size_t first = 0; first < p.half[0].size(); first += 16) {
    uint32_t any = 0;
    for (size_t i = first; i < first + 16; ++i) {
      const float ax = a.x - mx[i], ay = a.y - my[i], az = a.z - mz[i];
      const float ex = hx[i] + reach.x, ey = hy[i] + reach.y, ez = hz[i] + reach.z;
      const float cx = std::fabs(ay * way.z - az * way.y), cy = std::fabs(az * way.x - ax * way.z),
                  cz = std::fabs(ax * way.y - ay * way.x);
      any |= uint32_t(!(std::fabs(ax) > ex + 0.5f * d.x) & !(std::fabs(ay) > ey + 0.5f * d.y) &
                      !(std::fabs(az) > ez + 0.5f * d.z) & !(cx > ey * d.z + ez * d.y + rest) &
                      !(cy > ez * d.x + ex * d.z + rest) & !(cz > ex * d.y + ey * d.x + rest));
    }
    if (any) return true;
  }
  return false;
}

}  // namespace afterglow::instant_cache
