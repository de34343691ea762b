// SPDX-License-Identifier: GPL-3.0-or-later
// The triangles of a scene that emit light: a flat list, sorted by instance and triangle, so that a hit finds its
// entry. Two triangles that make a rectangle are one entry. Near entries are sampled by solid angle (Arvo 1995; Ureña
// et al. 2013), far ones by area; both sides shine, as in Cycles.
#pragma once

#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "lights/light_tree.h"
#include "materials/materials.h"
#include "scene/changes.h"

namespace afterglow {

/// A triangle a, a + edge_b, a + edge_c, or the rectangle over both edges.
struct EmissivePatch {
  Vec3 a, edge_b, edge_c;  // world, relative to Scene::origin()
  Vec3 normal{0.0f};       // unit, of the face
  float error = 0.0f;      // how far along the normal its points may lie from where a ray meets them
  uint32_t instance = kNone, material = 0;
  uint32_t triangle = kNone,
           second = kNone;  // of the mesh; second: the rectangle's other half, beyond the diagonal b c
  /// Which corner of each triangle stands at a (or opposite of it), at b and at c.
  uint8_t corners[2][3] = {{0, 1, 2}, {0, 1, 2}};
  bool rectangle() const { return second != kNone; }
};

struct PatchSample {
  Vec3 direction{0.0f};
  float distance = 0.0f;
  float density = 0.0f;
  Vec3 margin{0.0f};  // as in LightSample
  uint32_t triangle = kNone;
  Vec2 barycentric{0.0f};  // of the triangle's second and third corner
};

/// normal: as in Lights::sample; rectangles are sampled more where they stand high above the horizon.
bool sample_patch(const EmissivePatch&, const Vec3& position, const Vec3& normal, const Vec2& u, PatchSample&);
/// For a direction that meets the patch at this distance.
float patch_density(const EmissivePatch&, const Vec3& position, const Vec3& normal, const Vec3& direction,
                    float distance);

class EmissiveMeshes {
 public:
  /// Every triangle whose material emits and may be sampled.
  void collect(const Scene&, const Materials&);
  /// Whether these changes of meshes and instances concern any that emits or did. Materials: as at collect().
  bool touched_by(const SceneChanges&, const Scene&, const Materials&) const;
  const std::vector<EmissivePatch>& patches() const { return patches_; }
  /// Index into patches(), or kNone.
  uint32_t find(uint32_t instance, uint32_t triangle) const;
  LightBounds bounds(uint32_t index, const Rgb& mean_radiance) const;
  size_t bytes() const { return patches_.capacity() * sizeof(EmissivePatch); }

 private:
  struct Range {
    uint32_t first = 0, count = 0;
    uint32_t even = 0;  // 1, 2: each entry holds that many triangles and all emit: entry = first + triangle / even
  };
  std::vector<EmissivePatch> patches_;
  std::unordered_map<uint32_t, Range> ranges_;  // by instance
  std::unordered_set<Handle> sources_;          // handles of instances with an emitting slot
};

}  // namespace afterglow
