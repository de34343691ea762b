// SPDX-License-Identifier: GPL-3.0-or-later
// The triangles of a scene that emit light: a flat list, sorted by instance and triangle, so that a hit finds its
// entry. Near triangles are sampled by solid angle (Arvo 1995), far ones by area; both sides shine, as in Cycles.
#pragma once

#include <unordered_map>
#include <vector>

#include "lights/light_tree.h"
#include "materials/materials.h"

namespace afterglow {

struct EmissiveTriangle {
  Vec3 a, edge_b, edge_c;  // world, relative to Scene::origin()
  uint32_t instance = kNone, triangle = kNone;
  uint32_t material = 0;
};

struct TriangleSample {
  Vec3 direction{0.0f};
  float distance = 0.0f;
  float density = 0.0f;
  Vec2 barycentric{0.0f};
};

bool sample_triangle(const EmissiveTriangle&, const Vec3& position, const Vec2& u, TriangleSample&);
/// For a direction that meets the triangle at this distance.
float triangle_density(const EmissiveTriangle&, const Vec3& position, const Vec3& direction, float distance);

class EmissiveMeshes {
 public:
  /// Every triangle whose material emits and may be sampled.
  void collect(const Scene&, const Materials&);
  const std::vector<EmissiveTriangle>& triangles() const { return triangles_; }
  /// Index into triangles(), or kNone.
  uint32_t find(uint32_t instance, uint32_t triangle) const;
  bool holds(uint32_t instance) const { return ranges_.count(instance) != 0; }
  LightBounds bounds(uint32_t index, const Rgb& mean_radiance) const;
  size_t bytes() const { return triangles_.capacity() * sizeof(EmissiveTriangle); }

 private:
  struct Range {
    uint32_t first = 0, count = 0;
    bool whole = false;  // every triangle of the mesh: entry = first + triangle
  };
  std::vector<EmissiveTriangle> triangles_;
  std::unordered_map<uint32_t, Range> ranges_;  // by instance
};

}  // namespace afterglow
