// SPDX-License-Identifier: GPL-3.0-or-later
// The one wrapper of Embree 3 and 4: a two-level scene over the instances, closest hit and occlusion for single rays,
// occlusion for several at once.
// No Embree header is seen outside rays/.
#pragma once

#include <memory>
#include <span>

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
  /// Meshes that one instance alone uses may stand in a common BVH with their triangles in world space: rays through it
  /// are half as fast again, but what stands there cannot be changed by itself.
  enum class Flatten : uint8_t {
    kNever,
    kAlways,  // built anew when anything in it changed: same rays for the same scene, whatever came before
    kStill,   // for viewports: what changes leaves it and gets a BVH of its own, at once
  };
  struct Options {
    Flatten flatten = Flatten::kNever;
  };
  RayCaster();
  ~RayCaster();
  /// Rebuilds what changed; a moved instance rebuilds no mesh.
  void commit(const Scene&, const SceneChanges&, Options);
  bool closest(const Ray&, Hit&) const;
  bool occluded(const Ray&) const;
  /// At most kTogether rays at once, as from places side by side to one light: bit i tells of rays[i]. Half the time of
  /// one after the other where they stay together; a ray that passes an edge within rounding may be answered otherwise.
  static constexpr size_t kTogether = 16;
  uint32_t occluded(std::span<const Ray> rays) const;
  size_t bytes() const;

 private:
  friend struct RayMeasurement;
  friend class RaySubset;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace afterglow
