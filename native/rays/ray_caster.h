// SPDX-License-Identifier: GPL-3.0-or-later
// The one wrapper of Embree 3 and 4: a two-level scene over the instances, closest hit and occlusion for single rays.
// No Embree header is seen outside rays/.
#pragma once

#include <memory>

#include "scene/scene.h"

namespace afterglow {

/// Origin and directions are relative to Scene::origin(). mask: Visibility bits of the ray's kind.
struct Ray {
  Vec3 origin;
  float t_min = 0.0f;
  Vec3 direction;  // unit
  float t_max = kInfinity;
  uint32_t mask = kVisibleAll;
};

struct Hit {
  float t = kInfinity;
  float u = 0.0f, v = 0.0f;  // barycentric weights of the triangle's second and third corner
  uint32_t instance = kNone, triangle = kNone;
  bool valid() const { return instance != kNone; }
};

/// Instances that one view shows (local view): one bit an instance; empty: all.
using InstanceMask = std::vector<uint64_t>;

/// Embree's version, as "3.13.5".
std::string ray_library_version();

class RayCaster {
 public:
  struct Options {
    /// Instances whose mesh is used once go straight into the top-level BVH: faster rays, slower edits. For final
    /// renders.
    bool flatten = false;
  };
  RayCaster();
  ~RayCaster();
  /// Rebuilds what changed; a moved instance rebuilds no mesh.
  void commit(const Scene&, const SceneChanges&, Options);
  bool closest(const Ray&, Hit&) const;
  bool occluded(const Ray&) const;
  size_t bytes() const;

 private:
  friend struct RayMeasurement;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace afterglow
