// SPDX-License-Identifier: GPL-3.0-or-later
// A ray as Embree wants it (Wald et al. 2014), kept as thin as it can be. Internal to native/rays.
#pragma once

#include <cstddef>
#include <cstring>

#include "rays/embree.h"
#include "rays/ray_caster.h"

namespace afterglow {

using Lanes = float __attribute__((vector_size(16)));

/// Embree's answer to a ray that is not finite, or further out than it can square, is undefined; ours is: nothing is
/// hit. Origin and nearest distance, direction and furthest distance are compared four at a time.
inline bool usable(const Ray& ray) {
  static_assert(sizeof(Vec3) == 12 && offsetof(Ray, t_min) == 12 && offsetof(Ray, t_max) == 28);
  constexpr float largest = 1.844e18f;
  Lanes from, way;
  std::memcpy(&from, &ray.origin, 16);
  std::memcpy(&way, &ray.direction, 16);
  const Lanes bound{largest, largest, largest, kInfinity};
  const auto inside = (from <= bound) & (from >= -bound) & (way <= bound) & (way >= -bound);
  return (inside[0] & inside[1] & inside[2] & inside[3]) && ray.t_min <= ray.t_max;
}

inline void fill(RTCRay& to, const Ray& ray) {
  to.org_x = ray.origin.x;
  to.org_y = ray.origin.y;
  to.org_z = ray.origin.z;
  to.tnear = ray.t_min;
  to.dir_x = ray.direction.x;
  to.dir_y = ray.direction.y;
  to.dir_z = ray.direction.z;
  to.time = 0.0f;
  to.tfar = ray.t_max;
  to.mask = ray.mask;
  to.id = 0;
  to.flags = 0;
}

inline bool ray_occluded(RTCScene scene, const Ray& ray) {
  if (!usable(ray)) return false;
  RTCRay query;
  fill(query, ray);
  embree::occluded(scene, query);
  return query.tfar < 0.0f;
}

}  // namespace afterglow
